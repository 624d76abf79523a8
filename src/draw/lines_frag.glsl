/* A segment of a line at one pixel, as in draw_lines.c: both are to be changed together. Edges
 * are translucent; a translucent pixel belongs to the segment whose axis is nearer. */
uniform bool is_tube, has_normals; /* normals: of ribbons */
uniform float width_px, width, halo_px;
uniform float dash, gap, phase, arrow_spacing; /* mesh units */

flat in vec4 ends, beside;
flat in ivec2 has_beside;
flat in vec2 end_depths, ways, values, cut;
flat in vec3 direction, normal_a, normal_b;

const float RADIUS_LEAST = 0.5, EDGE = 0.5;
const float HEAD_WIDTH = 4.0, HEAD_LENGTH = 7.0, HEAD_PART_MAX = 0.8, HALO_SLOPE = 2.0;

float pixels_at(float z)
{
    return parallel ? scale : scale / z;
}

float radius_at(float z)
{
    return max((width > 0.0 ? width * pixels_at(z) : width_px) / 2.0, RADIUS_LEAST);
}

/* Of an arrow head where there is one, 0 in a gap. */
float radius_on(float way, float z)
{
    float radius = radius_at(z), moved = way - phase, period = dash + gap;
    if (arrow_spacing > 0.0) {
        float to_tip =
            arrow_spacing * (0.5 - moved / arrow_spacing + floor(moved / arrow_spacing));
        float len = HEAD_LENGTH * 2.0 * radius / (pixels_at(z) / unit);
        len = min(len, HEAD_PART_MAX * arrow_spacing);
        if (to_tip >= 0.0 && to_tip < len) return radius * max(1.0, HEAD_WIDTH * to_tip / len);
    }
    return gap > 0.0 && moved - floor(moved / period) * period >= dash ? 0.0 : radius;
}

/* Distance of a place from a segment; t: where along it. */
float off_of(vec2 at, vec2 a, vec2 b, out float t)
{
    vec2 way = b - a;
    float len2 = dot(way, way);
    t = len2 > 0.0 ? dot(at - a, way) / len2 : 0.0;
    return t <= 0.0 ? length(at - a) : t >= 1.0 ? length(at - b) : length(at - a - t * way);
}

/* Whether a segment from a to b beside this one, that ends (side -1) or begins (1) at a way, covers a
 * pixel: its way by pixel is about that of this one. Its distance else, or far. */
float off_beside(vec2 pixel, vec2 a, vec2 b, float way, float side, float z)
{
    float t, off = off_of(pixel, a, b, t);
    float by_pixel = (ways.y - ways.x) / max(length(ends.zw - ends.xy), 1e-6);
    float behind = (side < 0.0 ? 1.0 - t : t) * length(b - a);
    float radius = radius_on(way + side * behind * by_pixel, z);
    bool is_cap = t < 0.0 || t > 1.0;
    if (is_cap) radius = min(radius, radius_at(z));
    return radius > 0.0 && off <= radius + (radius > radius_at(z) ? 0.0 : EDGE) ? off : 1e30;
}

/* Whether the segments beside leave a pixel to this one. */
bool owns(vec2 pixel, float off, float z)
{
    return !(has_beside.x == 1 &&
             off_beside(pixel, beside.xy, ends.xy, ways.x, -1.0, z) <= off) &&
           !(has_beside.y == 1 && off_beside(pixel, ends.zw, beside.zw, ways.y, 1.0, z) < off);
}

void main()
{
    vec2 pixel = gl_FragCoord.xy - pixel_middle;
    float t, off = off_of(pixel, ends.xy, ends.zw, t), inside = clamp(t, 0.0, 1.0);
    float near = parallel ? 1.0 - inside : (1.0 - inside) / end_depths.x;
    float far = parallel ? inside : inside / end_depths.y, u = far / (near + far);
    float z = mix(end_depths.x, end_depths.y, u), part = mix(cut.x, cut.y, u);
    float radius = radius_on(mix(ways.x, ways.y, part + t - inside), z);
    bool is_cap = t < 0.0 || t > 1.0;
    if (is_cap) radius = min(radius, radius_at(z));
    bool is_head = radius > radius_at(z); /* sharp: its edge is of several segments */
    float cover = is_head ? (off <= radius ? 1.0 : 0.0) : min(radius + EDGE - off, 1.0);
    float alpha = opacity * cover;
    if (!(radius > 0.0) || (opacity < 1.0 && !translucent)) discard;
    if ((alpha < 1.0) != translucent) { /* a halo is a hole, under the edge of the line, too */
        if (is_cap || translucent || !(halo_px > 0.0) || off > radius + halo_px) discard;
        put(vec3(0.0), 0.0, z + HALO_SLOPE * off / pixels_at(z));
        return;
    }
    if (!(cover > 0.0) || (translucent && !owns(pixel, off, z))) discard;
    float round_off = sqrt(max(1.0 - off * off / (radius * radius), 0.0));
    float front = is_tube ? z - radius * round_off / pixels_at(z) : z;
    vec3 seen = color_of(mix(values.x, values.y, part)), view = view_of(pixel);
    if (lit && has_normals)
        seen = lighten(seen, cosine_of(mix(normal_a, normal_b, part), view));
    else if (lit) {
        float sine = min(length(cross(direction, view)) / (length(direction) * length(view)), 1.0);
        seen = lighten(seen, sine * (is_tube ? round_off : 1.0));
    }
    put(seen, alpha, front > 0.0 ? front : z);
}
