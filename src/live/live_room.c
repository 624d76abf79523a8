/* Memory: what each thread may take of the limit, and what is given up where something does not
 * fit. The limit is divided before anything is made, so that all together never pass it: the drawer
 * has what a window's pictures take, at most its part, the clerk a little, the builder the rest. */
#include <math.h>
#include <stdio.h>

#include "live/live.h"

/* Part of the limit that is kept for the drawer at least and at most; that of the clerk, who is
 * not held to it. */
static const double DRAWER_LEAST = 0.2, DRAWER_MOST = 0.65, CLERK_LEAST = 1.0 / 32;
/* What a pixel of the window takes: rays of four samples, and a frame of each that is held. */
enum { PIXEL_BYTES = 4 * 20 + 4 * 8, PIXEL_BYTES_LEAST = 20 + 3 * 8 };
/* Memory of a tet in a content and while it is made, bytes: a first guess of what fits where
 * something did not. */
enum { TET_BYTES = 600 };
/* What a content takes whatever its tets: tables of colours, patches that are decoded. */
enum { CONTENT_BYTES = 3 << 20 };
/* Fewer tets than this are no content. */
enum { TETS_LEAST = 1000 };
/* A picture with fewer pixels than one of so many by side is none. */
enum { REDUCTION_MOST = 4 };
/* Contents that are given up are waited for so long: a frame may still show them; seconds. */
static const double WAIT_S = 1;

static size_t part(const tl_live *live, double of)
{
    const double bytes = floor(of * (double)live->ram_limit);
    return bytes < (double)SIZE_MAX ? (size_t)bytes : SIZE_MAX;
}

static double pixels(const tl_live *live)
{
    return (double)live->width * live->height;
}

size_t tli_live_drawer_room(const tl_live *live)
{
    const size_t wanted = (size_t)(PIXEL_BYTES * pixels(live));
    const size_t least = part(live, DRAWER_LEAST), most = part(live, DRAWER_MOST);
    return wanted < least ? least : wanted > most ? most : wanted;
}

static size_t clerk_room(const tl_live *live)
{
    const size_t taken = tl_ctx_peak_bytes(live->clerk.ctx), least = part(live, CLERK_LEAST);
    return taken > least ? taken : least;
}

size_t tli_live_builder_room(const tl_live *live)
{
    const size_t others =
        tli_live_drawer_room(live) + clerk_room(live) + tl_ctx_current_bytes(live->ctx);
    const size_t all = part(live, 1);
    return all > others ? all - others : 1; /* 0: no limit */
}

/* ---- pictures ---- */

static double rays(const tl_live *live, uint32_t samples, uint32_t reduction)
{
    return pixels(live) * samples * samples / reduction / reduction;
}

void tli_live_fit_rays(const tl_live *live, uint32_t *samples, uint32_t *reduction)
{
    while (*samples > 1 && rays(live, *samples, *reduction) > live->rays_max) --*samples;
    while (*reduction < REDUCTION_MOST && rays(live, *samples, *reduction) > live->rays_max)
        ++*reduction;
}

uint32_t tli_live_samples(const tl_live *live, const tli_live_content *content)
{
    uint32_t reduction = 1;
    uint32_t samples =
        tl_content_samples(content->content, live->scene->scene, live->width, live->height);
    tli_live_fit_rays(live, &samples, &reduction);
    return samples;
}

static bool fewer_rays(tl_live *live, uint32_t samples, uint32_t reduction)
{
    if (samples <= 1 && reduction >= REDUCTION_MOST) return false;
    live->rays_max =
        samples > 1 ? rays(live, samples - 1, reduction) : rays(live, 1, reduction + 1);
    if (!live->has_said_rays)
        tli_live_event(live, TL_LIVE_NOTICE, TL_LIVE_DRAWING,
                       "the limit of memory allows the picture fewer rays than asked for");
    live->has_said_rays = true;
    return true;
}

bool tli_live_shrink_drawn(tl_live *live, const tli_live_content *content, uint32_t samples,
                           uint32_t reduction)
{
    const uint64_t tets = content->facts->tets / 2;
    if (fewer_rays(live, samples, reduction)) return true;
    if (!content->facts->is_model || tets < TETS_LEAST) return false;
    live->fits_tets = tets < live->fits_tets ? tets : live->fits_tets;
    live->rays_max = (double)INFINITY; /* the content was what did not fit */
    if (content == live->fine) live->fine = NULL;
    if (content == live->coarse) live->coarse = NULL;
    tli_live_drop_content(live, (tli_live_content *)(uintptr_t)content);
    tli_bell_ring(&live->builder.bell);
    return true;
}

/* ---- contents ---- */

/* Of two contents the one that is better given up. */
static tli_live_content **victim(tl_live *live)
{
    const bool is_new = live->fine->stamp == live->scene->stamp;
    return is_new && live->coarse->stamp != live->scene->stamp ? &live->coarse : &live->fine;
}

static void await_gone(tl_live *live)
{
    const double end = tli_clock_s() + WAIT_S;
    for (;;) {
        tli_live_clear_old(live);
        const unsigned kept = (live->coarse != NULL) + (live->fine != NULL);
        const double left = end - tli_clock_s();
        if (live->content_count <= kept || live->is_ending || live->open_path || left <= 0) return;
        tli_live_sleep(live, &live->builder.bell, left);
    }
}

/* Gives up what is kept for later, once for each content that finds no memory. */
static bool make_room(tl_live *live)
{
    if (live->made_room) return false;
    live->made_room = true;
    for (int i = 0; i < TLI_LIVE_CUTS; i++) tl_view_trim(live->source->views[i]);
    if (live->fine && live->coarse) {
        tli_live_content **gone = victim(live);
        tli_live_drop_content(live, *gone);
        *gone = NULL;
        live->is_drawn = false;
        tli_bell_ring(&live->drawer.bell);
        await_gone(live);
    }
    return true;
}

bool tli_live_shrink(tl_live *live, const tli_live_task *task)
{
    char text[TLI_LIVE_NOTE_BYTES];
    if (make_room(live)) return true;
    if (!tl_source_get_facts(live->source->source)->is_model)
        return tl_source_trim(live->source->source);
    bool first = live->fits_tets == UINT64_MAX;
    uint64_t tets = first ? (uint64_t)tli_live_builder_room(live) / TET_BYTES : live->fits_tets / 2;
    if (task->tets_max < UINT64_MAX && tets > task->tets_max / 2) tets = task->tets_max / 2;
    if (tets < TETS_LEAST) return false;
    live->fits_tets = tets;
    snprintf(text, sizeof text,
             "%.0f MiB of memory are allowed: the picture is coarser than asked for",
             (double)live->ram_limit / (1 << 20));
    if (first) tli_live_event(live, TL_LIVE_NOTICE, TL_LIVE_CONTENT, text);
    return true;
}

/* ---- what is said ---- */

/* Memory that a mesh takes at least: of a model its coarsest one, with its look and the file's
 * index beside it. */
static double mesh_bytes(const tl_live *live, const tl_source *source)
{
    const double held = (double)tl_ctx_current_bytes(live->builder.ctx) + CONTENT_BYTES;
    const tl_store *store = tl_source_store(source);
    if (!store) return held + TET_BYTES * (double)tl_source_get_facts(source)->tets;
    const tl_store_head *head = tl_store_get_head(store);
    const double tets = (double)head->levels[head->level_count - 1].tets;
    return held + TET_BYTES * fmax(tets, TETS_LEAST);
}

void tli_live_why(const tl_live *live, const tl_ctx *ctx, const tl_source *source, tl_live_job job,
                  tl_status status, char *text, size_t bytes)
{
    char what[80] = "a mesh of this data set";
    const double limit = (double)live->ram_limit, mib = 1 << 20;
    double wanted = PIXEL_BYTES_LEAST * pixels(live) / DRAWER_MOST;
    if (status != TL_ERR_BUDGET) {
        snprintf(text, bytes, "%s", tl_ctx_message(ctx));
        return;
    }
    if (job == TL_LIVE_OPEN && !source) { /* nobody knows what is in the file */
        tli_print(text, bytes, "the limit of %.3g MiB of memory is too low: %s", limit / mib,
                  tl_ctx_message(ctx));
        return;
    }
    if (job == TL_LIVE_DRAWING)
        snprintf(what, sizeof what, "a picture of %u x %u pixels", live->width, live->height);
    if (source) wanted = fmax(wanted, mesh_bytes(live, source) / (1 - DRAWER_MOST - CLERK_LEAST));
    wanted = fmax(wanted, 2 * limit);
    tli_print(text, bytes, "the limit of %.3g MiB of memory is too low for %s: %.0f MiB will do",
              limit / mib, what, ceil(wanted / mib));
}
