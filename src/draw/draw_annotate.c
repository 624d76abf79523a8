/* Annotation of pictures: what is asked for, the room that it takes. */
#include "draw/draw_annotate.h"

#include <math.h>

/* Lines of text in the height of a picture, in its width, and the smallest text that is read. */
static const double LINES = 54, COLUMNS = 64, TEXT_PX_LEAST = 9;
/* Room of the parts, in heights of text: scalar bars with their numbers, title, note, numbers
 * along the axes, and of each part from the edge of the picture. */
static const double BAR_ROOM = 7.5, TITLE_ROOM = 2.6, NOTE_ROOM = 1.8, AXES_ROOM = 4.2;
static const double EDGE_ROOM = 1;
/* Annotation takes at most this part of a side away. */
static const double WINDOW_LEAST = 0.4;

tl_annotation tl_annotation_defaults(void)
{
    return (tl_annotation){.struct_bytes = sizeof(tl_annotation)};
}

double tli_text_px(const tl_annotation *annotation, uint32_t width, uint32_t height)
{
    if (annotation->text_px > 0) return annotation->text_px;
    return fmax(TEXT_PX_LEAST, fmin(height / LINES, width / COLUMNS));
}

void tl_annotation_window(const tl_annotation *annotation, uint32_t width, uint32_t height,
                          double window[4])
{
    const double text = tli_text_px(annotation, width, height);
    const double axes = annotation->bounds && annotation->axes ? AXES_ROOM : 0;
    const double room[4] = {EDGE_ROOM + axes,
                            EDGE_ROOM + (annotation->bar_count ? BAR_ROOM : axes / 2),
                            EDGE_ROOM + axes + (annotation->note ? NOTE_ROOM : 0),
                            EDGE_ROOM + (annotation->title ? TITLE_ROOM : 0)};
    for (int side = 0; side < 4; side += 2) {
        const double pixels = side ? height : width;
        const double both = (room[side] + room[side + 1]) * text;
        const double shrink = fmin(1, (1 - WINDOW_LEAST) * pixels / both);
        window[side] = -1 + 2 * room[side] * text * shrink / pixels;
        window[side + 1] = 1 - 2 * room[side + 1] * text * shrink / pixels;
    }
}

static bool all_finite(const double *numbers, size_t count)
{
    for (size_t i = 0; i < count; i++)
        if (!isfinite(numbers[i])) return false;
    return true;
}

static tl_status check(tl_ctx *ctx, const tl_annotation *a)
{
    if (a->bounds && !all_finite(a->bounds, 6))
        return tl_fail(ctx, TL_ERR_ARG, "annotation: a box that is not finite");
    if (!(a->text_px >= 0) || !isfinite(a->text_px))
        return tl_fail(ctx, TL_ERR_ARG, "annotation: text %g pixels high", a->text_px);
    for (size_t i = 0; i < a->bar_count; i++) {
        const tl_scalar_bar *bar = &a->bars[i];
        if (!all_finite(bar->range, 2) || !all_finite(bar->shown, 2) ||
            !(bar->range[0] <= bar->range[1]) || (bar->logarithmic && !(bar->range[0] > 0)))
            return tl_fail(ctx, TL_ERR_ARG, "annotation: scalar bar %zu from %g to %g", i,
                           bar->range[0], bar->range[1]);
    }
    return TL_OK;
}

#if !TETRALOD_WITH_PANGO
static tl_status no_words(tl_ctx *ctx)
{
    return tl_fail(ctx, TL_ERR_UNSUPPORTED,
                   "this build writes nothing on pictures (Debian package libpango1.0-dev)");
}
#endif

tl_status tl_draw_annotation(tl_ctx *ctx, const tl_annotation *annotation, const tl_camera *camera,
                             tl_image *image)
{
    tli_frame frame;
    tl_status st = check(ctx, annotation);
    if (!st) st = tli_frame_set(ctx, camera, image, &frame);
#if TETRALOD_WITH_PANGO
    return st ? st : tli_annotate(ctx, annotation, &frame, image);
#else
    return st ? st : no_words(ctx);
#endif
}

tl_status tl_annotation_write(tl_ctx *ctx, const tl_annotation *annotation, const tl_camera *camera,
                              const tl_image *image, const char *path)
{
    tli_frame frame;
    tl_status st = check(ctx, annotation);
    if (!st) st = tli_frame_set(ctx, camera, image, &frame);
#if TETRALOD_WITH_PANGO
    return st ? st : tli_annotate_page(ctx, annotation, &frame, image, path);
#else
    (void)path;
    return st ? st : no_words(ctx);
#endif
}
