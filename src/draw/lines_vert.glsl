/* Rectangles around segments of lines: vertex 6 * i + k is a corner of the two triangles of segment
 * i. Sizes and colours are those of draw_lines.c. */
uniform usampler2D corners; /* place of its begin, and whether it begins and ends its line */
uniform sampler2D verts, normals; /* place and way along the line; normal and value */
uniform mat3 turn;
uniform vec3 offset;
uniform float width_px, width; /* pixels; units of the frame where above 0 */
uniform float head, halo_px;   /* width of arrow heads by that of the line; 1 without */

flat out vec4 ends;     /* of the segment on the picture, pixels */
flat out vec4 beside;   /* the other ends of the segments before and after */
flat out ivec2 has_beside;
flat out vec2 end_depths, ways, values, cut; /* cut: part of the segment where it begins and ends */
flat out vec3 direction, normal_a, normal_b; /* right, up, forward */

const float NEAREST = 1e-4, RADIUS_LEAST = 0.5;

vec3 vert(int i)
{
    vec3 at = turn * texelFetch(verts, place(i), 0).xyz + offset;
    return vec3(at.xy * scale, at.z);
}

/* Cuts off what is behind the camera between p and q; part: where. False: all of it. */
bool cut_near(inout vec3 p, inout vec3 q, out vec2 part)
{
    part = vec2(0.0, 1.0);
    if (p.z < NEAREST && q.z < NEAREST) return false;
    float at = (NEAREST - p.z) / (q.z - p.z);
    vec3 middle = vec3(p.xy + at * (q.xy - p.xy), NEAREST);
    if (p.z < NEAREST) {
        part.x = at;
        p = middle;
    } else if (q.z < NEAREST) {
        part.y = at;
        q = middle;
    }
    return true;
}

vec2 seen_at(vec3 p)
{
    return parallel ? p.xy : p.xy / p.z;
}

void main()
{
    uint entry = texelFetch(corners, place(gl_VertexID / 6), 0).r;
    int k = gl_VertexID % 6, i = int(entry & 0x3fffffffu);
    vec3 p = vert(i), q = vert(i + 1), before = p, after = q;
    direction = vec3((q.xy - p.xy) / scale, q.z - p.z);
    has_beside = ivec2(1u - (entry >> 30u & 1u), 1u - (entry >> 31u));
    bool seen = cut_near(p, q, cut);
    if (has_beside.x == 1) before = vert(i - 1);
    if (has_beside.y == 1) after = vert(i + 2);
    if (cut.x > 0.0 || before.z < NEAREST) has_beside.x = 0;
    if (cut.y < 1.0 || after.z < NEAREST) has_beside.y = 0;
    ends = vec4(seen_at(p), seen_at(q));
    beside = vec4(seen_at(before), seen_at(after));
    end_depths = vec2(p.z, q.z);
    vec4 a = texelFetch(normals, place(i), 0), b = texelFetch(normals, place(i + 1), 0);
    ways = vec2(texelFetch(verts, place(i), 0).w, texelFetch(verts, place(i + 1), 0).w);
    values = vec2(a.w, b.w);
    normal_a = turn * a.xyz;
    normal_b = turn * b.xyz;

    float near = min(p.z, q.z), radius = width > 0.0 ? width * scale / (parallel ? 1.0 : near)
                                                     : width_px;
    float reach = head * max(radius / 2.0, RADIUS_LEAST) + halo_px + 1.0;
    vec2 way = ends.zw - ends.xy;
    float len = length(way);
    vec2 along = len > 0.0 ? way / len : vec2(1.0, 0.0), across = vec2(-along.y, along.x);
    bool far_end = k == 1 || k == 2 || k == 4, left = k == 2 || k == 4 || k == 5;
    vec2 at = (far_end ? ends.zw + along * reach : ends.xy - along * reach) +
              across * (left ? reach : -reach);
    gl_Position = seen && !isinf(len) ? vec4((at + aside) / half_size, 0.0, 1.0) : NOT_SEEN;
}
