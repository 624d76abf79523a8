/* Lines on the processor (Sondershaus 2007, 7.3.3): bands around the projected line, as wide as
 * they are in pixels or in the mesh, shaded across as cylinders. The radius is a function of the
 * way along the line, so that arrow heads are cones that follow the bends, of one size on the
 * picture where widths are in pixels (the depth correction of the work). A halo is a hole that
 * falls away from its line, so that lines at one depth leave each other whole (Everts et al. 2009).
 *
 * Pieces are runs of a few segments. The segments of a run give each pixel one fragment, the
 * one that covers most of it, and a pixel belongs to the run whose axis is nearer: translucent
 * lines have no dark joints. */
#include <math.h>

#include "base/base_vec.h"
#include "draw/draw_layers.h"

/* Of opaque lines only pixels at edges matter to the runs beside. */
enum { RUN_SEGMENTS = 8, OPAQUE_BESIDE = 2, LINES_AT_ONCE = 64 };
/* Nothing nearer is drawn, in units of the frame. */
static const double NEAREST = 1e-4;
/* A pixel's part of the way from covered to not covered at an edge, to either side. */
static const double EDGE_PX = 0.5;
/* Thinner bands would have holes between pixels. */
static const double RADIUS_LEAST_PX = 0.5;
/* The length of an arrow head by the width of its line; at most this part of the
 * spacing. */
static const double HEAD_LENGTH = 7, HEAD_PART_MAX = 0.8;
/* Depth of a halo's point by its distance from the line. */
static const double HALO_SLOPE = 2;

/* Vertices nearer to the one before on the picture are passed over, pixels: they cost as much as
 * others and show nothing. */
static const double APART_PX = 0.5;

typedef struct run {
    tl_lidx first, last; /* of the vertices in use */
    bool begins, ends;   /* the line */
} run;

typedef struct lines {
    const tl_polydata *poly;
    const tl_look *look;
    const tl_line_opts *opts;
    const tli_frame *frame;
    /* vertices in use: those of line i from poly->starts[i] on, counts[i] of them */
    tl_lidx *verts, *counts;
    double (*places)[3]; /* in the frame */
    double *ways;        /* from the begin of the line, mesh units */
    run *runs;
    size_t run_count;
} lines;

/* A segment on the picture. */
typedef struct band {
    double a[2], way[2], length_square; /* from a, in pixels of the frame */
    double z[2];
    double cut;  /* part of the segment before a, where the near end was cut off */
    double left; /* part of it that is there */
    tl_lidx at;  /* vertex in use where it begins */
} band;

/* What a run shows at a pixel. */
typedef struct spot {
    double z, cover;     /* cover: of the pixel, 0 to 1 */
    double across, part; /* 0 on the axis, 1 at the edge; part of the segment */
    tl_lidx at;          /* vertex in use where the segment begins */
} spot;

/* ---- sizes ---- */

/* Pixels of a length in mesh units at a depth. */
static double pixels_at(const tli_frame *f, double length, double z)
{
    double pixels = length / f->unit * f->scale;
    return f->parallel ? pixels : pixels / z;
}

/* Half of the width of the line itself, pixels. */
static double radius_at(const lines *l, double z)
{
    double radius =
        l->opts->width > 0 ? pixels_at(l->frame, l->opts->width, z) / 2 : l->opts->width_px / 2;
    return radius > RADIUS_LEAST_PX ? radius : RADIUS_LEAST_PX;
}

/* The same at a place of the line: of an arrow head where there is one, 0 in a gap. */
static double radius_on(const lines *l, double way, double z)
{
    const tl_line_opts *o = l->opts;
    double radius = radius_at(l, z), moved = way - o->phase;
    if (o->arrow_spacing > 0) {
        /* the tip is at the middle of each spacing */
        double to_tip =
            o->arrow_spacing * (0.5 - moved / o->arrow_spacing + floor(moved / o->arrow_spacing));
        double length = HEAD_LENGTH * 2 * radius / pixels_at(l->frame, 1, z);
        length = fmin(length, HEAD_PART_MAX * o->arrow_spacing);
        if (to_tip >= 0 && to_tip < length)
            return radius * fmax(1, TLI_ARROW_WIDTH * to_tip / length);
    }
    double period = o->dash + o->gap;
    if (o->gap > 0 && moved - floor(moved / period) * period >= o->dash) return 0;
    return radius;
}

/* The largest distance from the axis where a piece is seen. */
static double reach_at(const lines *l, double z)
{
    double head = l->opts->arrow_spacing > 0 ? TLI_ARROW_WIDTH : 1;
    return head * radius_at(l, z) + fmax(EDGE_PX, l->opts->halo_px);
}

/* ---- bands ---- */

static bool box(const void *data, size_t piece, double low[2], double high[2])
{
    const lines *l = data;
    const run *r = &l->runs[piece];
    double nearest = INFINITY;
    const double(*places)[3] = (const double(*)[3])(l->places + r->first);
    size_t count = r->last - r->first + 1;
    if (!tli_frame_box(l->frame, places, count, low, high)) return false;
    for (size_t i = 0; i < count; i++) nearest = fmin(nearest, places[i][2]);
    double reach = reach_at(l, fmax(nearest, NEAREST));
    for (int k = 0; k < 2; k++) {
        low[k] -= reach;
        high[k] += reach;
    }
    return true;
}

/* False for a segment behind the camera. */
static bool set_band(const lines *l, tl_lidx at, band *b)
{
    double p[3], q[3], ends[2] = {0, 1};
    for (int k = 0; k < 3; k++) {
        p[k] = l->places[at][k];
        q[k] = l->places[at + 1][k];
    }
    if (p[2] < NEAREST && q[2] < NEAREST) return false;
    if (p[2] < NEAREST || q[2] < NEAREST) {
        double part = (NEAREST - p[2]) / (q[2] - p[2]);
        double *behind = p[2] < NEAREST ? p : q;
        ends[p[2] < NEAREST ? 0 : 1] = part;
        for (int k = 0; k < 2; k++) behind[k] = p[k] + part * (q[k] - p[k]);
        behind[2] = NEAREST;
    }
    b->at = at;
    b->cut = ends[0];
    b->left = ends[1] - ends[0];
    b->z[0] = p[2];
    b->z[1] = q[2];
    b->length_square = 0;
    for (int k = 0; k < 2; k++) {
        b->a[k] = l->frame->parallel ? p[k] : p[k] / p[2];
        b->way[k] = (l->frame->parallel ? q[k] : q[k] / q[2]) - b->a[k];
        b->length_square += b->way[k] * b->way[k];
    }
    return isfinite(b->length_square);
}

/* ---- pixels ---- */

/* A run in a tile. */
typedef struct canvas {
    const lines *l;
    tli_tile *tile;
    uint32_t low[2], high[2]; /* columns and rows in use, [low, high) */
    spot spots[TLI_TILE_PIXELS];
    double halos[TLI_TILE_PIXELS];   /* depths */
    double offs[3][TLI_TILE_PIXELS]; /* from the axis of this run, the one before, the one after */
} canvas;

enum { OWN, BEFORE, AFTER };

/* The pixel at a distance from a band; t: where along it, below 0 and above 1 at its round ends. */
static void mark(canvas *c, const band *b, int whose, uint32_t pixel, double off, double t)
{
    const lines *l = c->l;
    bool parallel = l->frame->parallel, is_cap = t < 0 || t > 1;
    double in = t < 0 ? 0 : t > 1 ? 1 : t;
    double near = parallel ? 1 - in : (1 - in) / b->z[0], far = parallel ? in : in / b->z[1];
    double u = far / (near + far), z = b->z[0] + u * (b->z[1] - b->z[0]);
    double part = b->cut + u * b->left, way = l->ways[b->at + 1] - l->ways[b->at];
    double radius = radius_on(l, l->ways[b->at] + (part + t - in) * way, z);
    if (is_cap) radius = fmin(radius, radius_at(l, z)); /* heads are no balls where a line bends */
    double unit = (parallel ? 1 : z) / l->frame->scale; /* of the frame, by pixel */
    if (!(radius > 0) || off > radius + fmax(EDGE_PX, l->opts->halo_px)) return;
    bool is_head = radius > radius_at(l, z); /* sharp: its edge is of several segments */
    double cover = is_head ? off <= radius : fmin(radius + EDGE_PX - off, 1);
    if (cover < 1 && whose == OWN && !is_cap && off <= radius + l->opts->halo_px) {
        double depth = z + HALO_SLOPE * off * unit;
        if (depth < c->halos[pixel]) c->halos[pixel] = depth;
    }
    if (!(cover > 0)) return;
    spot *s = &c->spots[pixel];
    double across = fmin(off / radius, 1), depth = z;
    if (l->opts->shape == TL_LINE_TUBE) depth -= radius * sqrt(1 - across * across) * unit;
    if (off < c->offs[whose][pixel]) c->offs[whose][pixel] = off;
    if (whose == OWN && (cover > s->cover || (cover >= s->cover && depth < s->z)))
        *s = (spot){depth > 0 ? depth : z, cover, across, part, b->at};
}

/* Columns and rows of the tile, [low, high), within reach of a band; false: none. */
static bool clip(const lines *l, const tli_tile *tile, const band *b, uint32_t low[2],
                 uint32_t high[2])
{
    double reach = reach_at(l, fmin(b->z[0], b->z[1]));
    for (int k = 0; k < 2; k++) {
        double from = fmin(b->a[k], b->a[k] + b->way[k]) - reach;
        double to = fmax(b->a[k], b->a[k] + b->way[k]) + reach;
        double begin = k ? tile->py - to : from - tile->px,
               end = k ? tile->py - from : to - tile->px;
        uint32_t count = k ? tile->height : tile->width;
        low[k] = (uint32_t)fmin(fmax(ceil(begin), 0), count);
        high[k] = (uint32_t)fmin(fmax(floor(end) + 1, 0), count);
    }
    return low[0] < high[0] && low[1] < high[1];
}

static void mark_band(canvas *c, const band *b, int whose, const uint32_t low[2],
                      const uint32_t high[2])
{
    const tli_tile *tile = c->tile;
    double reach = reach_at(c->l, fmin(b->z[0], b->z[1]));
    for (uint32_t y = low[1]; y < high[1]; y++)
        for (uint32_t x = low[0]; x < high[0]; x++) {
            double d[2] = {tile->px + x - b->a[0], tile->py - y - b->a[1]};
            double t = d[0] * b->way[0] + d[1] * b->way[1];
            t = b->length_square > 0 ? t / b->length_square : 0;
            double in = t < 0 ? 0 : t > 1 ? 1 : t;
            double side[2] = {d[0] - in * b->way[0], d[1] - in * b->way[1]};
            double square = side[0] * side[0] + side[1] * side[1];
            if (square <= reach * reach) mark(c, b, whose, y * TLI_TILE_PX + x, sqrt(square), t);
        }
}

/* Marks what segments [first, last) cover within the part of the tile that is in use. */
static void mark_bands(canvas *c, tl_lidx first, tl_lidx last, int whose)
{
    for (tl_lidx at = first; at < last; at++) {
        band b;
        uint32_t low[2], high[2];
        if (!set_band(c->l, at, &b) || !clip(c->l, c->tile, &b, low, high)) continue;
        for (int k = 0; k < 2; k++) {
            low[k] = low[k] > c->low[k] ? low[k] : c->low[k];
            high[k] = high[k] < c->high[k] ? high[k] : c->high[k];
        }
        mark_band(c, &b, whose, low, high);
    }
}

/* The part of the tile that a run may cover, made empty; false: none. */
static bool open_canvas(canvas *c, const run *r)
{
    c->low[0] = c->low[1] = TLI_TILE_PX;
    c->high[0] = c->high[1] = 0;
    for (tl_lidx at = r->first; at < r->last; at++) {
        band b;
        uint32_t low[2], high[2];
        if (!set_band(c->l, at, &b) || !clip(c->l, c->tile, &b, low, high)) continue;
        for (int k = 0; k < 2; k++) {
            c->low[k] = low[k] < c->low[k] ? low[k] : c->low[k];
            c->high[k] = high[k] > c->high[k] ? high[k] : c->high[k];
        }
    }
    for (uint32_t y = c->low[1]; y < c->high[1]; y++)
        for (uint32_t x = c->low[0]; x < c->high[0]; x++) {
            uint32_t i = y * TLI_TILE_PX + x;
            c->spots[i].z = c->halos[i] = INFINITY;
            c->spots[i].cover = 0;
            c->offs[OWN][i] = c->offs[BEFORE][i] = c->offs[AFTER][i] = INFINITY;
        }
    return c->low[0] < c->high[0] && c->low[1] < c->high[1];
}

/* Marks what up to count segments of the runs beside cover. */
static void mark_beside(canvas *c, const run *r, tl_lidx count)
{
    const run *before = r->begins ? r : r - 1, *after = r->ends ? r : r + 1;
    if (!r->begins && before->last - before->first > count)
        mark_bands(c, before->last - count, before->last, BEFORE);
    else if (!r->begins)
        mark_bands(c, before->first, before->last, BEFORE);
    if (!r->ends && after->last - after->first > count)
        mark_bands(c, after->first, after->first + count, AFTER);
    else if (!r->ends)
        mark_bands(c, after->first, after->last, AFTER);
}

/* True if the runs beside leave a pixel to this one: they find the same distances. */
static bool owns(const canvas *c, uint32_t pixel)
{
    double off = c->offs[OWN][pixel];
    return off < c->offs[BEFORE][pixel] && off <= c->offs[AFTER][pixel];
}

/* ---- colours ---- */

/* Sine of the angle between the line and the view at a pixel: 1 across, 0 straight away. */
static double sine_of(const lines *l, tl_lidx at, double px, double py)
{
    const tli_frame *f = l->frame;
    const tl_lidx *v = l->verts + at;
    double way[3], view[3], cross[3];
    vec_sub(l->poly->xyz + 3 * (size_t)v[1], l->poly->xyz + 3 * (size_t)v[0], way);
    for (int k = 0; k < 3; k++) way[k] /= f->unit;
    tli_frame_view(f, px, py, view);
    vec_cross(way, view, cross);
    double sine = vec_length(cross) / (vec_length(way) * vec_length(view));
    return sine <= 1 ? sine : 1;
}

static void shade(const lines *l, const spot *s, double px, double py, float rgba[4])
{
    const tl_look *look = l->look;
    const tl_lidx *v = l->verts + s->at;
    double scalar = 0, cosine;
    if (look->scalar)
        scalar = look->scalar[v[0]] + s->part * (look->scalar[v[1]] - look->scalar[v[0]]);
    tli_look_color(look, scalar, rgba);
    if (look->lit) {
        const float *normals = l->poly->normals;
        if (l->opts->shape == TL_LINE_RIBBON && normals) {
            double normal[3];
            for (size_t k = 0; k < 3; k++) {
                double a = (double)normals[3 * (size_t)v[0] + k];
                normal[k] = a + s->part * ((double)normals[3 * (size_t)v[1] + k] - a);
            }
            cosine = tli_frame_cosine(l->frame, px, py, normal);
        } else {
            cosine = sine_of(l, s->at, px, py);
            if (l->opts->shape == TL_LINE_TUBE) cosine *= sqrt(1 - s->across * s->across);
        }
        tli_look_light(look, cosine, rgba);
    }
    float opacity = (float)(look->opacity * s->cover);
    for (int k = 0; k < 3; k++) rgba[k] *= opacity;
    rgba[3] = opacity;
}

/* A hole: nothing is seen behind it, nor itself. */
static void put_halo(tli_tile *tile, uint32_t pixel, float z)
{
    if (!(z <= tile->z[pixel])) return;
    tile->z[pixel] = z;
    for (int k = 0; k < 4; k++) tile->rgba[pixel][k] = 0;
}

static void draw(const void *data, size_t piece, tli_tile *tile)
{
    canvas c; /* large: only what is used is set */
    c.l = data;
    c.tile = tile;
    const run *r = &c.l->runs[piece];
    if (!open_canvas(&c, r)) return;
    bool is_opaque = c.l->look->opacity >= 1, has_halo = c.l->opts->halo_px > 0 && is_opaque;
    mark_bands(&c, r->first, r->last, OWN);
    mark_beside(&c, r, is_opaque ? OPAQUE_BESIDE : RUN_SEGMENTS);
    for (uint32_t y = c.low[1]; y < c.high[1]; y++)
        for (uint32_t x = c.low[0]; x < c.high[0]; x++) {
            float rgba[4];
            uint32_t pixel = y * TLI_TILE_PX + x;
            const spot *s = &c.spots[pixel];
            if (has_halo && c.halos[pixel] < INFINITY) put_halo(tile, pixel, (float)c.halos[pixel]);
            if (!(s->z < INFINITY && (float)s->z <= tile->z[pixel])) continue;
            if (!(is_opaque && s->cover >= 1) && !owns(&c, pixel)) continue;
            shade(c.l, s, tile->px + x, tile->py - y, rgba);
            tli_tile_put(tile, pixel, (float)s->z, rgba);
        }
}

/* ---- the layer ---- */

static void release(tl_ctx *ctx, void *data)
{
    lines *l = data;
    tl_mem_free(ctx, l->runs);
    tl_mem_free(ctx, l->ways);
    tl_mem_free(ctx, l->places);
    tl_mem_free(ctx, l->counts);
    tl_mem_free(ctx, l->verts);
    tl_mem_free(ctx, l);
}

/* True if two places can't be told from each other on the picture. */
static bool are_one(const tli_frame *f, const double a[3], const double b[3])
{
    if (!(a[2] >= NEAREST && b[2] >= NEAREST)) return false;
    double za = f->parallel ? 1 : a[2], zb = f->parallel ? 1 : b[2];
    return hypot(b[0] / zb - a[0] / za, b[1] / zb - a[1] / za) < APART_PX;
}

/* Chooses the vertices of a line that are in use: the ends, and what shows. */
static void place_line(const lines *l, size_t line)
{
    double way = 0;
    size_t first = l->poly->starts[line], end = l->poly->starts[line + 1], next = first;
    const double *before = NULL;
    for (size_t i = first; i < end; i++) {
        double step[3], place[3];
        tl_lidx vert = l->poly->corners[i];
        const double *x = l->poly->xyz + 3 * (size_t)vert;
        if (before) vec_sub(x, before, step);
        if (before && vec_is_finite(step)) way += vec_length(step);
        before = x;
        tli_frame_place(l->frame, x, place);
        bool is_end = i == first || i + 1 == end;
        if (!is_end && are_one(l->frame, l->places[next - 1], place)) continue;
        for (int k = 0; k < 3; k++) l->places[next][k] = place[k];
        l->ways[next] = way;
        l->verts[next++] = vert;
    }
    l->counts[line] = (tl_lidx)(next - first);
}

static tl_status place_lines(void *arg, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    for (size_t line = begin; line < end; line++) place_line(arg, line);
    return TL_OK;
}

/* Cuts lines into runs, also where a vertex is not finite; runs NULL: only counts. */
static size_t make_runs(const lines *l, run *runs)
{
    size_t count = 0;
    for (size_t line = 0; line < l->poly->cell_count; line++) {
        tl_lidx first = l->poly->starts[line], end = first + l->counts[line];
        bool begins = true;
        while (first + 1 < end) {
            tl_lidx last = first;
            bool is_good = vec_is_finite(l->places[first]);
            while (is_good && last + 1 < end && last - first < RUN_SEGMENTS &&
                   vec_is_finite(l->places[last + 1]))
                last++;
            bool goes_on = last + 1 < end && last - first == RUN_SEGMENTS &&
                           vec_is_finite(l->places[last + 1]);
            if (last > first) {
                if (runs) runs[count] = (run){first, last, begins, !goes_on};
                count++;
            }
            begins = !goes_on;
            first = goes_on ? last : last + 1;
        }
    }
    return count;
}

tl_status tli_layer_lines(tl_ctx *ctx, const tl_polydata *poly, const tl_look *look,
                          const tl_line_opts *opts, const tli_frame *frame, tli_layer *layer)
{
    tl_status st = TL_OK;
    size_t corners = tli_corner_count(poly);
    lines *l = tl_mem_zalloc(ctx, 1, sizeof *l, &st);
    if (st) return st;
    *l = (lines){.poly = poly, .look = look, .opts = opts, .frame = frame};
    l->verts = tl_mem_alloc(ctx, corners, sizeof *l->verts, &st);
    l->counts = tl_mem_alloc(ctx, poly->cell_count, sizeof *l->counts, &st);
    l->places = tl_mem_alloc(ctx, corners, sizeof *l->places, &st);
    l->ways = tl_mem_alloc(ctx, corners, sizeof *l->ways, &st);
    if (!st) st = tli_parallel(ctx, poly->cell_count, LINES_AT_ONCE, place_lines, l);
    if (!st) l->run_count = look->opacity > 0 ? make_runs(l, NULL) : 0;
    l->runs = tl_mem_alloc(ctx, l->run_count, sizeof *l->runs, &st);
    if (!st && l->run_count) make_runs(l, l->runs);
    if (st)
        release(ctx, l);
    else
        *layer = (tli_layer){l, l->run_count, box, draw, release};
    return st;
}
