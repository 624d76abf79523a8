/* Words on a picture: what a scene's picture node asks for, and what a model promises. */
#include <math.h>
#include <stdio.h>

#include "view/view.h"

static bool wants(const tl_scene *scene, const char *part)
{
    return tl_scene_flag(scene, TL_NODE_PICTURE + 1, part);
}

static void add_bar(const tl_values *values, tl_scalar_bar *bar)
{
    *bar = (tl_scalar_bar){.title = values->title,
                           .transfer = values->transfer,
                           .shown = {values->shown_range[0], values->shown_range[1]},
                           .range = {values->range[0], values->range[1]},
                           .logarithmic = values->logarithmic};
}

/* What an annotation borrows: values [value_count], bounds, note, background. */
static tl_annotation annotation_of(const tl_scene *scene, const tl_values *const *values,
                                   size_t value_count, const double *bounds, tl_scalar_bar *bars)
{
    tl_annotation a = tl_annotation_defaults();
    const char *title = tl_scene_text(scene, TL_NODE_PICTURE + 1, "title");
    a.title = *title ? title : NULL;
    a.outline = wants(scene, "box");
    a.axes = wants(scene, "axes");
    a.triad = wants(scene, "triad");
    if (a.outline || a.axes) a.bounds = bounds;
    for (size_t i = 0; wants(scene, "bar") && i < value_count; i++)
        add_bar(values[i], &bars[a.bar_count++]);
    a.bars = bars;
    return a;
}

void tl_content_note(const tl_content *content, char *text, size_t bytes)
{
    const tl_content_facts *f = &content->facts;
    tl_text count = tl_text_count(f->tets);
    size_t n = (size_t)snprintf(text, bytes, "%s tets", count.s);
    if (!f->is_model || n >= bytes) return;
    count = tl_text_count(f->source_tets);
    n += (size_t)snprintf(text + n, bytes - n, " of %s", count.s);
    if (n < bytes && isfinite(f->error_px))
        n += (size_t)tli_print(text + n, bytes - n, ", off by at most %.4g pixels", f->error_px);
    for (size_t i = 0; i < f->error_count && n < bytes / 2; i++)
        if (tl_content_values(content, f->errors[i].channel) && isfinite(f->errors[i].error))
            n += (size_t)tli_print(text + n, bytes - n, ", %s within %.4g",
                                   tl_text_name(f->errors[i].channel).s, f->errors[i].error);
}

/* Onto the picture, or with it onto the page at path. */
static tl_status annotate(tl_ctx *ctx, const tl_content *content, const tl_scene *scene,
                          const tl_camera *camera, tl_image *picture, const tl_image *image,
                          const char *path)
{
    enum { NOTE_BYTES = 512 };
    tl_status st = TL_OK;
    char note[NOTE_BYTES];
    tl_value color;
    float background[3];
    tl_scalar_bar *bars = tl_mem_alloc(ctx, content->bar_count, sizeof *bars, &st);
    if (st) return st;
    tl_annotation a =
        annotation_of(scene, content->bars, content->bar_count, content->facts.bounds, bars);
    st = tl_scene_get(ctx, scene, TL_NODE_PICTURE + 1, "background", &color);
    if (!st && color.count == 3) {
        for (int k = 0; k < 3; k++) background[k] = (float)color.reals[k];
        a.background = background;
    }
    if (wants(scene, "note")) {
        tl_content_note(content, note, sizeof note);
        a.note = note;
    }
    if (!st)
        st = path ? tl_annotation_write(ctx, &a, camera, image, path)
                  : tl_draw_annotation(ctx, &a, camera, picture);
    tl_mem_free(ctx, bars);
    return st;
}

tl_status tl_content_annotate(tl_ctx *ctx, const tl_content *content, const tl_scene *scene,
                              const tl_camera *camera, tl_image *image)
{
    return annotate(ctx, content, scene, camera, image, NULL, NULL);
}

tl_status tl_content_write(tl_ctx *ctx, const tl_content *content, const tl_scene *scene,
                           const tl_camera *camera, const tl_image *image, const char *path)
{
    return annotate(ctx, content, scene, camera, NULL, image, path);
}

tl_status tl_view_window(tl_ctx *ctx, tl_view *view, const tl_scene *scene, uint32_t width,
                         uint32_t height, double window[4])
{
    tli_agenda agenda;
    tl_status st = tli_agenda_create(ctx, view, scene, &agenda);
    if (st) return st;
    const tl_values **values = tl_mem_alloc(ctx, agenda.paint_count, sizeof *values, &st);
    tl_scalar_bar *bars = tl_mem_alloc(ctx, agenda.paint_count, sizeof *bars, &st);
    if (!st) {
        const size_t count = tli_agenda_bars(&agenda, values);
        tl_annotation a = annotation_of(scene, values, count, agenda.look->bounds, bars);
        a.note = wants(scene, "note") ? "note" : NULL;
        tl_annotation_window(&a, width, height, window);
    }
    tl_mem_free(ctx, bars);
    tl_mem_free(ctx, values);
    tli_agenda_release(ctx, &agenda);
    return st;
}
