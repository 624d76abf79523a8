/* tetralod info of a model: the mesh it was built from, its levels, and where the bytes go. */
#include "cli_model.h"

#include <math.h>
#include <string.h>

/* Regions that are listed one by one in text. */
#define REGIONS_PRINTED 16
/* Steps that are; of more the first and the last ones. */
#define STEPS_PRINTED 8

/* Tets of all levels together. */
static uint64_t stored_tets(const tl_store_head *head)
{
    uint64_t tets = 0;
    for (uint32_t l = 0; l < head->level_count; l++) tets += head->levels[l].tets;
    return tets;
}

static double channel_bits(const tl_store_head *head)
{
    double bits = 0;
    for (uint32_t c = 0; c < head->channel_count; c++) bits += 8 * (double)head->channels[c].bytes;
    return bits;
}

/* Of the range of a channel. */
static double width_of(const tl_store_channel *channel)
{
    return channel->range[1] - channel->range[0];
}

/* ---- JSON ---- */

static void json_cells(json_t *object, const tl_store_head *head)
{
    json_t *cells = cli_json_object(object, "cells");
    for (uint32_t k = 0; k < head->cell_kind_count && k < TL_CELL_KIND_COUNT; k++)
        if (head->cells[k])
            cli_json_count(cells, tl_cell_kind_name((tl_cell_kind)k), head->cells[k]);
}

static void json_channels(json_t *object, const tl_store_head *head)
{
    json_t *list = cli_json_list(object, "channels");
    for (uint32_t c = 0; c < head->channel_count; c++) {
        const tl_store_channel *channel = &head->channels[c];
        json_t *item = cli_json_item(list);
        cli_json_text(item, "name", channel->name);
        if (channel->has_step) cli_json_count(item, "step", channel->step);
        cli_json_count(item, "components", channel->components);
        cli_json_text(item, "on", channel->on == TL_ON_VERTEX ? "vertex" : "tet");
        cli_json_reals(item, "range", channel->range, 2);
        cli_json_text(item, "unit", channel->unit);
        cli_json_count(item, "nonfinite", channel->nonfinite_count);
        cli_json_real(item, "codec_error", channel->codec_error);
        cli_json_real(item, "time", channel->time);
        cli_json_count(item, "bytes", channel->bytes);
    }
}

static void json_steps(json_t *object, const tl_store_head *head)
{
    cli_model_step step = {0};
    json_t *list = cli_json_list(object, "steps");
    while (cli_next_step(head, &step)) {
        json_t *item = cli_json_item(list);
        cli_json_count(item, "step", step.number);
        cli_json_real(item, "time", step.time);
    }
}

static void json_regions(json_t *object, const tl_store_head *head)
{
    cli_json_count(object, "region_count", head->region_count);
    json_t *list = cli_json_list(object, "regions");
    for (uint32_t i = 0; i < head->regions_listed; i++) {
        json_t *item = cli_json_item(list);
        json_object_set_new(item, "id", json_integer((json_int_t)head->regions[i].id));
        cli_json_count(item, "tets", head->regions[i].tets);
        if (*head->regions[i].name) cli_json_text(item, "name", head->regions[i].name);
    }
}

/* graph may be NULL. */
static void json_levels(json_t *object, const tl_store_head *head, const cli_graph *graph)
{
    json_t *list = cli_json_list(object, "levels");
    for (uint32_t l = 0; l < head->level_count; l++) {
        const tl_store_level *level = &head->levels[l];
        json_t *item = cli_json_item(list);
        cli_json_count(item, "tets", level->tets);
        if (level->verts != TL_STORE_UNKNOWN) cli_json_count(item, "vertices", level->verts);
        cli_json_count(item, "segments", level->segment_count);
        cli_json_count(item, "patches", level->patch_count);
        cli_json_real(item, "boundary_error", level->boundary_error);
        json_t *errors = cli_json_list(item, "error");
        for (uint32_t c = 0; c < head->channel_count; c++) {
            json_t *error = cli_json_item(errors);
            cli_json_text(error, "channel", head->channels[c].name);
            if (head->channels[c].has_step) cli_json_count(error, "step", head->channels[c].step);
            cli_json_real(error, "error", level->max_error[c]);
            if (graph) cli_json_real(error, "rms", graph->rms[l * head->channel_count + c]);
        }
    }
}

static void json_view(json_t *object, const char *key, const cli_graph_view *view)
{
    json_t *item = cli_json_object(object, key);
    cli_json_count(item, "tets", view->tets);
    cli_json_count(item, "patches", view->patches);
    cli_json_count(item, "segments", view->segments);
}

static void json_locality(json_t *object, const cli_graph *graph)
{
    json_t *item = cli_json_object(object, "full_detail_at_a_point");
    json_view(item, "mean", &graph->mean);
    json_view(item, "worst", &graph->worst);
}

static void json_sizes(json_t *object, const tl_store_head *head)
{
    const double tets = (double)stored_tets(head);
    cli_json_count(object, "bytes", head->file_bytes);
    cli_json_real(object, "bytes_per_input_tet",
                  (double)head->file_bytes / (double)head->input_tets);
    json_t *bits = cli_json_object(object, "bits_per_tet");
    cli_json_real(bits, "connectivity", head->connectivity_bits / tets);
    cli_json_real(bits, "positions", head->place_bits / tets);
    cli_json_real(bits, "channels", channel_bits(head) / tets);
    cli_json_real(bits, "flags", head->flag_bits / tets);
    cli_json_real(bits, "regions", head->region_bits / tets);
    cli_json_real(object, "border_share", head->border_share);
    cli_json_real(object, "position_error", head->position_error);
}

static void print_json(const cli_session *session, const char *path, const tl_store_head *head,
                       const cli_graph *graph)
{
    json_t *object = json_object();
    cli_json_text(object, "file", path);
    cli_json_count(object, "format_version", TL_STORE_VERSION);
    cli_json_count(object, "vertices", head->input_verts);
    cli_json_count(object, "tets", head->input_tets);
    json_cells(object, head);
    cli_json_stats(object, &head->stats);
    cli_json_real(object, "time", head->time);
    json_steps(object, head);
    json_channels(object, head);
    json_regions(object, head);
    cli_json_count(object, "tets_stored", stored_tets(head));
    cli_json_count(object, "segments", head->segment_count);
    cli_json_count(object, "patches", head->patch_count);
    cli_json_count(object, "root_patches", head->root_patch_count);
    json_levels(object, head, graph);
    if (graph) json_locality(object, graph);
    json_sizes(object, head);
    cli_json_facts(object, session->ctx);
    cli_json_print(object);
}

/* ---- text ---- */

static void print_cells(const tl_store_head *head)
{
    const char *label = "cells";
    for (uint32_t k = 0; k < head->cell_kind_count && k < TL_CELL_KIND_COUNT; k++)
        if (head->cells[k]) {
            printf("%-10s  %s %s\n", label, cli_count(head->cells[k]).s,
                   tl_cell_kind_name((tl_cell_kind)k));
            label = "";
        }
}

static void print_regions(const tl_store_head *head)
{
    if (!head->region_count) return;
    printf("regions     %s:", cli_count(head->region_count).s);
    for (uint32_t i = 0; i < head->regions_listed && i < REGIONS_PRINTED; i++) {
        const tl_store_region *region = &head->regions[i];
        printf("%s %lld", i ? "," : "", (long long)region->id);
        if (*region->name) printf(" '%s'", cli_name(region->name).s);
        printf(" (%s tets)", cli_count(region->tets).s);
    }
    puts(head->region_count > REGIONS_PRINTED ? " ..." : "");
}

static void print_sizes(const tl_store_head *head)
{
    const double tets = (double)stored_tets(head);
    printf("model       levels: %s, segments: %s, patches: %s (roots: %s), tets stored: %s\n",
           cli_count(head->level_count).s, cli_count(head->segment_count).s,
           cli_count(head->patch_count).s, cli_count(head->root_patch_count).s,
           cli_count(stored_tets(head)).s);
    printf("size        %s bytes an input tet; bits a stored tet: connectivity %s, positions %s, "
           "channels %s\n",
           cli_real((double)head->file_bytes / (double)head->input_tets).s,
           cli_real(head->connectivity_bits / tets).s, cli_real(head->place_bits / tets).s,
           cli_real(channel_bits(head) / tets).s);
    printf("positions   within %s (%s of the diagonal); %s of the vertices lie on borders\n",
           cli_real(head->position_error).s,
           cli_share(head->position_error, head->stats.diagonal).s,
           cli_share(head->border_share, 1).s);
}

static void print_steps(const tl_store_head *head)
{
    cli_model_step step = {0};
    uint32_t count = 0;
    while (cli_next_step(head, &step)) count++;
    if (!count) return;
    step = (cli_model_step){0};
    printf("steps       %s:", cli_count(count).s);
    for (uint32_t i = 0; cli_next_step(head, &step); i++) {
        if (count > STEPS_PRINTED && i == STEPS_PRINTED / 2) fputs(" ...", stdout);
        if (count > STEPS_PRINTED && i >= STEPS_PRINTED / 2 && i + STEPS_PRINTED / 2 < count)
            continue;
        printf(" %u", step.number);
        if (isfinite(step.time)) printf(" (time %s)", cli_real(step.time).s);
    }
    puts("");
}

/* Whether a channel is the same field as another one, at any step. */
static bool is_same_field(const tl_store_channel *a, const tl_store_channel *b)
{
    return a->on == b->on && a->has_step == b->has_step && a->components == b->components &&
           strcmp(a->name, b->name) == 0;
}

/* The channel with all its steps, if it is the first of them; *steps 0: a later one. */
static tl_store_channel sum_steps(const tl_store_head *head, uint32_t c, uint32_t *steps)
{
    tl_store_channel sum = head->channels[c];
    *steps = 1;
    for (uint32_t i = 0; i < head->channel_count; i++) {
        const tl_store_channel *other = &head->channels[i];
        if (i == c || !sum.has_step || !is_same_field(other, &sum)) continue;
        if (i < c) *steps = 0;
        if (!*steps) break;
        ++*steps;
        sum.range[0] = fmin(sum.range[0], other->range[0]);
        sum.range[1] = fmax(sum.range[1], other->range[1]);
        sum.codec_error = fmax(sum.codec_error, other->codec_error);
        sum.bytes += other->bytes;
    }
    return sum;
}

/* A line a field: its steps together. */
static tl_status print_channels(tl_ctx *ctx, const tl_store_head *head)
{
    cli_table table;
    uint32_t steps, count = 0, row = 0;
    for (uint32_t c = 0; c < head->channel_count; c++) {
        sum_steps(head, c, &steps);
        count += steps > 0;
    }
    if (!count) {
        puts("channels    none");
        return TL_OK;
    }
    tl_status st = cli_table_create(ctx, count + 1, 8, &table);
    if (st) return st;
    cli_table_head(&table, "channel|on|components|steps|range|codec error|bytes|unit");
    for (uint32_t c = 0; c < head->channel_count; c++) {
        const tl_store_channel channel = sum_steps(head, c, &steps);
        if (!steps) continue;
        cli_table_set(&table, ++row, 0, cli_name(channel.name));
        cli_table_set(&table, row, 1, cli_name(channel.on == TL_ON_VERTEX ? "vertex" : "tet"));
        cli_table_set(&table, row, 2, cli_count(channel.components));
        cli_table_set(&table, row, 3, channel.has_step ? cli_count(steps) : cli_name("-"));
        cli_table_set(&table, row, 4, cli_range(channel.range));
        cli_table_set(&table, row, 5, cli_real(channel.codec_error));
        cli_table_set(&table, row, 6, cli_bytes((double)channel.bytes));
        cli_table_set(&table, row, 7, cli_name(channel.unit));
    }
    putchar('\n');
    cli_table_print(&table, 0);
    cli_table_destroy(&table);
    return TL_OK;
}

/* The channel whose error is largest as a part of its range stands for all. */
static double worst_share(const tl_store_head *head, const tl_store_level *level)
{
    double worst = 0;
    for (uint32_t c = 0; c < head->channel_count; c++) {
        const double width = width_of(&head->channels[c]);
        if (width > 0) worst = fmax(worst, level->max_error[c] / width);
    }
    return worst;
}

/* The same of the RMS error. */
static double worst_rms(const tl_store_head *head, const cli_graph *graph, uint32_t level)
{
    double worst = 0;
    for (uint32_t c = 0; c < head->channel_count; c++) {
        const double width = width_of(&head->channels[c]);
        if (width > 0) worst = fmax(worst, graph->rms[level * head->channel_count + c] / width);
    }
    return worst;
}

/* graph may be NULL. */
static tl_status print_levels(tl_ctx *ctx, const tl_store_head *head, const cli_graph *graph)
{
    cli_table table;
    tl_status st = cli_table_create(ctx, head->level_count + 1, graph ? 7 : 6, &table);
    if (st) return st;
    cli_table_head(&table, graph ? "level|tets|segments|patches|error|boundary error|RMS error"
                                 : "level|tets|segments|patches|error|boundary error");
    for (uint32_t l = 0; l < head->level_count; l++) {
        const tl_store_level *level = &head->levels[l];
        cli_table_set(&table, l + 1, 0, cli_count(l));
        cli_table_set(&table, l + 1, 1, cli_count(level->tets));
        cli_table_set(&table, l + 1, 2, cli_count(level->segment_count));
        cli_table_set(&table, l + 1, 3, cli_count(level->patch_count));
        cli_table_set(&table, l + 1, 4, cli_share(worst_share(head, level), 1));
        cli_table_set(&table, l + 1, 5, cli_share(level->boundary_error, head->stats.diagonal));
        if (graph) cli_table_set(&table, l + 1, 6, cli_share(worst_rms(head, graph, l), 1));
    }
    putchar('\n');
    cli_table_print(&table, 0);
    cli_table_destroy(&table);
    return TL_OK;
}

static void print_locality(const cli_graph *graph)
{
    printf("\nlocality    full detail at one point draws %s tets in %s patches, %s in %s at most\n",
           cli_count(graph->mean.tets).s, cli_count(graph->mean.patches).s,
           cli_count(graph->worst.tets).s, cli_count(graph->worst.patches).s);
}

static tl_status print_text(cli_session *session, const char *path, const tl_store_head *head,
                            const cli_graph *graph)
{
    printf("%-10s  %s: a model of %s tets, %s vertices (%s)\n", "read", path,
           cli_count(head->input_tets).s, cli_count(head->input_verts).s,
           cli_bytes((double)head->file_bytes).s);
    print_cells(head);
    cli_print_shape(&head->stats, head->time, head->input_tets);
    print_regions(head);
    print_sizes(head);
    print_steps(head);
    tl_status st = print_channels(session->ctx, head);
    if (!st) st = print_levels(session->ctx, head, graph);
    if (!st && graph) print_locality(graph);
    return st;
}

int cli_info_store(cli_session *session, const char *path)
{
    tl_store *store = NULL;
    cli_graph graph = {0}, *details = NULL;
    tl_status st = tl_store_open(session->ctx, path, &store);
    if (!st && cli_get(session, CLI_DETAILS)->given) {
        st = cli_graph_create(session->ctx, store, &graph);
        details = &graph;
    }
    if (!st && cli_get(session, CLI_JSON)->given)
        print_json(session, path, tl_store_get_head(store), details);
    else if (!st && cli_loud(session))
        st = print_text(session, path, tl_store_get_head(store), details);
    cli_graph_destroy(session->ctx, &graph);
    tl_store_close(store);
    return st ? cli_fail(session, session->ctx, st) : CLI_DONE;
}
