/* Title, note and scalar bars; the order in which annotation is drawn. */
#include "draw/draw_annotate.h"

#include <math.h>

/* In heights of text. */
static const double EDGE = 1, BAR_WIDTH = 1.1, GAP = 0.45, TICK = 0.35, LINE_HEIGHT = 1.5;
static const double TITLE_SCALE = 1.35, NOTE_SCALE = 0.85, NUMBER_SCALE = 0.9;
/* Lengths of bars in heights of the picture; of its width what the title of one may take. */
static const double BAR_LEAST = 0.12, BAR_MOST = 0.52, BAR_MOST_OF_SEVERAL = 0.39;
static const double TITLE_PART = 0.3;
/* Lines of text that have room above a bar. */
static const double BAR_LINES = 3;
/* Height of text that numbers beside a bar keep from each other. */
static const double NUMBER_ROOM = 2.6;
/* Lines are so wide, in heights of text. */
static const double LINE_WIDTH = 0.06;

static const double BRIGHT[3] = {1, 1, 1}, DARK[3] = {0.13, 0.13, 0.15};
/* Backgrounds brighter than this have dark text. */
static const double LUMINANCE_MIDDLE = 0.45;

static bool is_dark(const float *background)
{
    if (!background) return false;
    return 0.2126 * (double)background[0] + 0.7152 * (double)background[1] +
               0.0722 * (double)background[2] <
           LUMINANCE_MIDDLE;
}

static void draw_title(tli_canvas *canvas, const char *title, const tl_image *image, double text_px)
{
    const tli_words words = {.text = title,
                             .scale = TITLE_SCALE,
                             .is_bold = true,
                             .width_px = image->width - 2 * EDGE * text_px};
    tli_canvas_text(canvas, &words, image->width / 2.0, EDGE * text_px, (double[]){0.5, 0});
}

static void draw_note(tli_canvas *canvas, const char *note, const tl_image *image, double text_px)
{
    const tli_words words = {
        .text = note, .scale = NOTE_SCALE, .width_px = image->width - 2 * EDGE * text_px};
    tli_canvas_text(canvas, &words, EDGE * text_px, image->height - EDGE * text_px / 2,
                    (double[]){0, 1});
}

/* ---- scalar bars ---- */

/* The edges of a bar, pixels. */
typedef struct bar_place {
    double left, right, top, bottom;
} bar_place;

static void draw_colors(tli_canvas *canvas, const tl_scalar_bar *bar, const bar_place *place)
{
    const int rows = (int)(place->bottom - place->top);
    for (int row = 0; row < rows; row++) {
        const double t = 1 - (row + 0.5) / rows;
        float rgb[3];
        double extinction;
        tl_transfer_at(bar->transfer, bar->shown[0] * (1 - t) + bar->shown[1] * t, rgb,
                       &extinction);
        const double color[3] = {(double)rgb[0], (double)rgb[1], (double)rgb[2]};
        tli_canvas_rectangle(canvas, place->left, place->top + row, place->right - place->left, 1,
                             color);
    }
}

static void draw_frame(tli_canvas *canvas, const bar_place *p, double width_px)
{
    const double corners[5][2] = {{p->left, p->top},
                                  {p->right, p->top},
                                  {p->right, p->bottom},
                                  {p->left, p->bottom},
                                  {p->left, p->top}};
    for (int i = 0; i < 4; i++) tli_canvas_line(canvas, corners[i], corners[i + 1], width_px, 1);
}

static void draw_numbers(tli_canvas *canvas, const tl_tick *ticks, size_t count,
                         const bar_place *place, double text_px)
{
    for (size_t i = 0; i < count; i++) {
        const double y = place->bottom + ticks[i].at * (place->top - place->bottom);
        const double length = (ticks[i].label[0] ? TICK : TICK / 2) * text_px;
        const tli_words words = {.text = ticks[i].label, .scale = NUMBER_SCALE};
        tli_canvas_line(canvas, (double[]){place->right, y}, (double[]){place->right + length, y},
                        LINE_WIDTH * text_px, 1);
        if (ticks[i].label[0])
            tli_canvas_text(canvas, &words, place->right + GAP * text_px, y, (double[]){0, 0.5});
    }
}

/* Width of the widest label. */
static double number_width(tli_canvas *canvas, const tl_tick *ticks, size_t count)
{
    double widest = 0, size[2];
    for (size_t i = 0; i < count; i++) {
        const tli_words words = {.text = ticks[i].label, .scale = NUMBER_SCALE};
        if (!ticks[i].label[0]) continue;
        tli_canvas_measure(canvas, &words, size);
        widest = fmax(widest, size[0]);
    }
    return widest;
}

static void draw_bar(tli_canvas *canvas, const tl_scalar_bar *bar, double top, double bottom,
                     uint32_t width, double text_px)
{
    tl_tick ticks[TL_TICKS_MAX];
    char factor[TL_TICK_BYTES];
    int exponent = 0;
    const double length = bottom - top, right = width - EDGE * text_px;
    const size_t most = (size_t)fmax(2, length / (NUMBER_ROOM * text_px));
    const size_t count = bar->logarithmic
                             ? tl_ticks_log(bar->range[0], bar->range[1], most, ticks)
                             : tl_ticks(bar->range[0], bar->range[1], most, ticks, &exponent);
    tl_exponent_text(exponent, factor);
    bar_place place = {.top = floor(top), .bottom = floor(bottom)};
    place.right = floor(right - number_width(canvas, ticks, count) - GAP * text_px);
    place.left = place.right - floor(BAR_WIDTH * text_px);
    draw_colors(canvas, bar, &place);
    draw_frame(canvas, &place, LINE_WIDTH * text_px);
    draw_numbers(canvas, ticks, count, &place, text_px);
    const tli_words title = {.text = bar->title, .scale = 1, .width_px = TITLE_PART * width};
    const tli_words power = {.text = factor, .scale = NUMBER_SCALE};
    double above = top - GAP * text_px;
    if (exponent) {
        tli_canvas_text(canvas, &power, right, above, (double[]){1, 1});
        above -= LINE_HEIGHT * text_px;
    }
    tli_canvas_text(canvas, &title, right, above, (double[]){1, 1});
}

/* One above the other, in the middle of the right side. */
static void draw_bars(tli_canvas *canvas, const tl_annotation *a, const tl_image *image,
                      double text_px)
{
    const double free = image->height - (2 * EDGE + LINE_HEIGHT * TITLE_SCALE) * text_px;
    const double words = BAR_LINES * LINE_HEIGHT * text_px; /* above each */
    const double most = a->bar_count > 1 ? BAR_MOST_OF_SEVERAL : BAR_MOST;
    double length = fmin(free / (double)a->bar_count - words, most * image->height);
    length = fmax(length, BAR_LEAST * image->height);
    double top = image->height / 2.0 - ((length + words) * (double)a->bar_count - words) / 2;
    for (size_t i = 0; i < a->bar_count; i++) {
        draw_bar(canvas, &a->bars[i], top, top + length, image->width, text_px);
        top += length + words;
    }
}

/* ---- all ---- */

/* What is in front of the picture. */
static void draw_front(tli_canvas *canvas, const tl_annotation *a, const tli_frame *frame,
                       const tl_image *image, double text_px)
{
    if (a->bounds) tli_axes_front(canvas, a, frame, text_px);
    if (a->triad) tli_triad(canvas, frame, image->height, text_px);
    if (a->bar_count) draw_bars(canvas, a, image, text_px);
    if (a->note) draw_note(canvas, a->note, image, text_px);
    if (a->title) draw_title(canvas, a->title, image, text_px);
}

tl_status tli_annotate(tl_ctx *ctx, const tl_annotation *a, const tli_frame *frame, tl_image *image)
{
    const double text_px = tli_text_px(a, image->width, image->height);
    const bool dark = is_dark(a->background);
    tli_canvas *canvas = NULL;
    tl_status st = tli_canvas_open(ctx, image->width, image->height, dark ? BRIGHT : DARK,
                                   dark ? DARK : BRIGHT, text_px, &canvas);
    if (!st && a->bounds) {
        tli_axes_behind(canvas, a, frame, text_px);
        st = tli_canvas_merge(canvas, true, image);
    }
    if (!st) {
        draw_front(canvas, a, frame, image, text_px);
        st = tli_canvas_merge(canvas, false, image);
    }
    tli_canvas_close(canvas);
    return st;
}

tl_status tli_annotate_page(tl_ctx *ctx, const tl_annotation *a, const tli_frame *frame,
                            const tl_image *image, const char *path)
{
    const double text_px = tli_text_px(a, image->width, image->height);
    const bool dark = is_dark(a->background);
    tli_canvas *canvas = NULL;
    tl_status st =
        tli_canvas_open_page(ctx, path, image->width, image->height, a->background,
                             dark ? BRIGHT : DARK, dark ? DARK : BRIGHT, text_px, &canvas);
    if (st) return st;
    if (a->bounds) tli_axes_behind(canvas, a, frame, text_px);
    st = tli_canvas_paint(canvas, image);
    if (!st) draw_front(canvas, a, frame, image, text_px);
    const tl_status end = tli_canvas_close_page(canvas, !st);
    return st ? st : end;
}
