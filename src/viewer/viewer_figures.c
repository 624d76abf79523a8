/* Words for what is on the screen. They follow the frames, at most so often that they can be read;
 * between a change and the picture that shows it they are those of the past, and said to be. */
#include "viewer_figures.h"

#include <math.h>
#include <stdio.h>

#include "viewer_core.h"

/* While pictures change, the words do at most so often. */
enum { REFRESH_MS = 150 };
/* Errors below it are not told apart. */
static const double LEAST_PX = 0.01;

static const char *const TIPS[VIEWER_FIGURE_COUNT] = {
    [VIEWER_FIGURE_STATE] = "Whether the picture is all that was asked for",
    [VIEWER_FIGURE_ERROR] = "By how many pixels what is seen may be off, at most; where a peak was "
                            "lost, by how much the values",
    [VIEWER_FIGURE_TETS] = "Tets that are drawn, of those of the data set",
    [VIEWER_FIGURE_PATCHES] = "Pieces of the model that are drawn",
    [VIEWER_FIGURE_FRAME] = "What the picture took to draw",
    [VIEWER_FIGURE_READ] = "Read from the file so far",
    [VIEWER_FIGURE_CHANNELS] = "How far the values that are shown may be from those of the data",
};
static const char *const NAMES[VIEWER_FIGURE_COUNT] = {
    "state", "error", "tets", "patches", "frame", "memory", "read", "channels", "note"};

struct viewer_figures {
    char *texts[VIEWER_FIGURE_COUNT]; /* NULL: not known */
    char *memory_tip;
    bool is_passing;
    guint later;
};

/* ---- numbers as text ---- */

/* To three digits; units from start on for numbers of four digits and more. */
static char *unit_text(double value, double least, const char *const *units, int unit_count)
{
    int unit = 0;
    if (value >= least)
        while (value >= 1000 && unit + 1 < unit_count) value /= 1000, unit++;
    const int digits = unit == 0 || value >= 100 ? 0 : value >= 10 ? 1 : 2;
    return g_strdup_printf("%.*f%s", digits, value, units[unit]);
}

char *viewer_count_text(double count)
{
    static const char *const UNITS[] = {"", " k", " M", " G"};
    return unit_text(count, 10000, UNITS, G_N_ELEMENTS(UNITS));
}

char *viewer_bytes_text(double bytes)
{
    static const char *const UNITS[] = {" B", " kB", " MB", " GB", " TB"};
    return unit_text(bytes, 1000, UNITS, G_N_ELEMENTS(UNITS));
}

/* ---- words of a frame ---- */

static void put(struct viewer_figures *f, viewer_figure figure, char *text)
{
    g_free(f->texts[figure]);
    f->texts[figure] = text;
}

/* The bound of the channel shown that may be off by the largest part of its range; NULL: there is
 * none. */
static const tl_content_error *worst_error(const tl_frame *frame)
{
    const tl_content_facts *facts = frame->facts;
    const tl_content_error *worst = NULL;
    double most = 0;
    for (size_t i = 0; i < facts->error_count; i++) {
        const tl_content_error *e = &facts->errors[i];
        const tl_values *shown = tl_content_values(frame->content, e->channel);
        if (!shown || !isfinite(e->error)) continue;
        const double part = e->error / (shown->range[1] - shown->range[0]);
        if (worst && !(part > most)) continue;
        worst = e;
        most = part;
    }
    return worst;
}

/* In pixels of this frame; where a value that is visible was lost, as the peaks of a volume in a
 * coarse mesh, so that its surface has no place, in the unit of the channel. */
static char *error_text(const tl_frame *frame)
{
    const double px = frame->error_px;
    if (!frame->facts->is_model) return g_strdup("exact");
    if (px == 0) return g_strdup("error 0 px");
    if (px < LEAST_PX) return g_strdup_printf("error < %.2f px", LEAST_PX);
    if (isfinite(px)) return g_strdup_printf("error ≤ %.*f px", px < 10 ? 2 : px < 100 ? 1 : 0, px);
    const tl_content_error *worst = worst_error(frame);
    if (!worst) return g_strdup("error not bounded");
    return g_strdup_printf("%s ± %.2g", tl_text_name(worst->channel).s, worst->error);
}

static char *tets_text(const tl_content_facts *facts)
{
    char *drawn = viewer_count_text((double)facts->tets);
    char *all = viewer_count_text((double)facts->source_tets);
    char *text = facts->tets == facts->source_tets ? g_strdup_printf("%s tets", drawn)
                                                   : g_strdup_printf("%s of %s tets", drawn, all);
    g_free(drawn);
    g_free(all);
    return text;
}

/* Of the channels that are shown. */
static char *channels_text(const tl_frame *frame)
{
    const tl_content_facts *facts = frame->facts;
    GString *text = g_string_new(NULL);
    for (size_t i = 0; i < facts->error_count; i++)
        if (frame->content && tl_content_values(frame->content, facts->errors[i].channel))
            g_string_append_printf(text, "%s%s ± %.2g", text->len ? " · " : "",
                                   facts->errors[i].channel, facts->errors[i].error);
    return g_string_free(text, FALSE);
}

static void take_facts(struct viewer_figures *f, const tl_frame *frame)
{
    const tl_content_facts *facts = frame->facts;
    put(f, VIEWER_FIGURE_ERROR, error_text(frame));
    put(f, VIEWER_FIGURE_TETS, tets_text(facts));
    put(f, VIEWER_FIGURE_CHANNELS, channels_text(frame));
    put(f, VIEWER_FIGURE_PATCHES,
        facts->is_model ? g_strdup_printf("%" G_GUINT64_FORMAT " patch%s", facts->patches,
                                          facts->patches == 1 ? "" : "es")
                        : NULL);
}

static void take_costs(struct viewer_figures *f, const tl_frame *frame, const tl_live_stats *stats)
{
    const double seconds = frame->is_moving && stats->frame_s > 0 ? stats->frame_s : frame->draw_s;
    char *ram = viewer_bytes_text((double)stats->ram_bytes);
    char *limit = viewer_bytes_text((double)stats->ram_limit_bytes);
    char *card = viewer_bytes_text((double)stats->card_bytes);
    char *read = viewer_bytes_text((double)stats->bytes_read);
    put(f, VIEWER_FIGURE_FRAME, g_strdup_printf("%.0f ms", 1e3 * seconds));
    put(f, VIEWER_FIGURE_MEMORY, g_strdup(ram));
    put(f, VIEWER_FIGURE_READ, stats->bytes_read ? g_strdup_printf("%s read", read) : NULL);
    g_free(f->memory_tip);
    f->memory_tip = g_strdup_printf("Memory of data and pictures: %s, at most %s\n%s on the card\n"
                                    "Drawn by %s",
                                    ram, limit, card, frame->renderer);
    g_free(read);
    g_free(card);
    g_free(limit);
    g_free(ram);
}

static void say_state(viewer *v)
{
    struct viewer_figures *f = v->figures;
    const tl_frame *frame = v->frame;
    f->is_passing =
        !frame || !frame->is_final || frame->scene_version != tl_scene_version(v->scene);
    put(f, VIEWER_FIGURE_STATE,
        g_strdup(!frame             ? ""
                 : frame->is_moving ? "moving"
                 : f->is_passing    ? "refining"
                                    : "at rest"));
}

static void take(viewer *v)
{
    struct viewer_figures *f = v->figures;
    const tl_live_stats stats = tl_live_get_stats(v->live);
    say_state(v);
    if (v->frame->facts) take_facts(f, v->frame);
    take_costs(f, v->frame, &stats);
    put(f, VIEWER_FIGURE_NOTE, *v->frame->note ? g_strdup(v->frame->note) : NULL);
    viewer_tell(v, VIEWER_FIGURES);
}

/* ---- when ---- */

static gboolean on_later(gpointer data)
{
    viewer *v = data;
    v->figures->later = 0;
    if (v->frame) take(v);
    return G_SOURCE_REMOVE;
}

static void on_frame(viewer *v, void *user)
{
    struct viewer_figures *f = user;
    if (!v->frame->is_final) {
        if (!f->later) f->later = g_timeout_add(REFRESH_MS, on_later, v);
        return;
    }
    if (f->later) g_source_remove(f->later);
    f->later = 0;
    take(v);
}

/* What was asked for is another thing from now on: the figures are the past's at once. */
static void on_change(viewer *v, void *user)
{
    const struct viewer_figures *f = user;
    if (!v->frame || f->is_passing) return;
    say_state(v);
    if (f->is_passing) viewer_tell(v, VIEWER_FIGURES);
}

static void on_source(viewer *v, void *user)
{
    struct viewer_figures *f = user;
    for (int i = 0; i < VIEWER_FIGURE_COUNT; i++) put(f, (viewer_figure)i, NULL);
    f->is_passing = true;
    viewer_tell(v, VIEWER_FIGURES);
}

/* ---- asked by others ---- */

const char *viewer_figure_text(const viewer *v, viewer_figure figure)
{
    const char *text = v->figures->texts[figure];
    return text ? text : "";
}

/* What a figure is, in a sentence or a few lines; NULL: nothing to say. */
static const char *tip_of(const viewer *v, viewer_figure figure)
{
    if (figure == VIEWER_FIGURE_MEMORY) return v->figures->memory_tip;
    return figure == VIEWER_FIGURE_NOTE ? v->figures->texts[figure] : TIPS[figure];
}

bool viewer_figures_are_passing(const viewer *v)
{
    return v->figures->is_passing;
}

void viewer_figures_show(const viewer *v, const viewer_figure *figures, size_t count,
                         GtkWidget *label)
{
    GString *text = g_string_new(NULL), *tip = g_string_new(NULL);
    for (size_t i = 0; i < count; i++) {
        const char *about = tip_of(v, figures[i]);
        if (!*viewer_figure_text(v, figures[i])) continue;
        g_string_append_printf(text, "%s%s", text->len ? " · " : "",
                               viewer_figure_text(v, figures[i]));
        if (about) g_string_append_printf(tip, "%s%s", tip->len ? "\n" : "", about);
    }
    gtk_label_set_text(GTK_LABEL(label), text->str);
    gtk_widget_set_tooltip_text(label, tip->len ? tip->str : NULL);
    if (v->figures->is_passing)
        gtk_widget_add_css_class(label, "tl-passing");
    else
        gtk_widget_remove_css_class(label, "tl-passing");
    g_string_free(tip, TRUE);
    g_string_free(text, TRUE);
}

static bool print_figures(viewer *v, const char *arguments)
{
    (void)arguments;
    viewer_flush(v); /* what is asked for by now */
    for (int i = 0; i < VIEWER_FIGURE_COUNT; i++)
        printf("figure %s %s\n", NAMES[i], viewer_figure_text(v, (viewer_figure)i));
    fflush(stdout);
    return true;
}

static const viewer_command COMMANDS[] = {{"figures", "figures", print_figures}};

/* ---- the part ---- */

void viewer_figures_attach(viewer *v)
{
    v->figures = g_new0(struct viewer_figures, 1);
    v->figures->is_passing = true;
    viewer_add_commands(v, COMMANDS, G_N_ELEMENTS(COMMANDS));
    viewer_listen(v, VIEWER_FRAME, on_frame, v->figures);
    viewer_listen(v, VIEWER_SCENE, on_change, v->figures);
    viewer_listen(v, VIEWER_CAMERA, on_change, v->figures);
    viewer_listen(v, VIEWER_SOURCE, on_source, v->figures);
}

void viewer_figures_destroy(viewer *v)
{
    if (v->figures->later) g_source_remove(v->figures->later);
    for (int i = 0; i < VIEWER_FIGURE_COUNT; i++) g_free(v->figures->texts[i]);
    g_free(v->figures->memory_tip);
    g_clear_pointer(&v->figures, g_free);
}
