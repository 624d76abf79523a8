/* Corners of tets: vertex 4 * i + k is corner k of the i-th tet in order. Only faces that look away
 * from the camera are left by culling, so that each tet covers a pixel once, also one that the
 * camera stands in. */
uniform usampler2D order, tets;
uniform sampler2D verts; /* x, y in pixels from the middle (perspective: times z), depth, value */
uniform int first;       /* of the order */

out vec4 part;         /* barycentric: 1 of its own corner */
flat out vec4 rate;    /* of each part by depth; perspective: parts of the camera's place */
flat out vec4 depths, values; /* of the corners */
flat out uvec4 ids;

void main()
{
    int corner = gl_VertexID & 3;
    int tet = int(texelFetch(order, place(first + (gl_VertexID >> 2)), 0).r);
    ids = texelFetch(tets, place(tet), 0);
    vec4 a = texelFetch(verts, place(int(ids.x)), 0), b = texelFetch(verts, place(int(ids.y)), 0);
    vec4 c = texelFetch(verts, place(int(ids.z)), 0), d = texelFetch(verts, place(int(ids.w)), 0);
    vec4 own = corner == 0 ? a : corner == 1 ? b : corner == 2 ? c : d;
    depths = vec4(a.z, b.z, c.z, d.z);
    values = vec4(a.w, b.w, c.w, d.w);
    part = vec4(corner == 0, corner == 1, corner == 2, corner == 3);

    vec3 ab = b.xyz - a.xyz, ac = c.xyz - a.xyz, ad = d.xyz - a.xyz;
    vec3 bc = c.xyz - b.xyz, bd = d.xyz - b.xyz;
    vec3 nb = cross(ac, ad), nc = cross(ad, ab), nd = cross(ab, ac), na = cross(bd, bc);
    float volume = dot(ab, nb);
    rate = parallel ? vec4(na.z, nb.z, nc.z, nd.z)
                    : -vec4(dot(b.xyz, na), dot(a.xyz, nb), dot(a.xyz, nc), dot(a.xyz, nd));
    rate /= volume;
    /* x, y and depth are left-handed; flat and inverted tets show nothing */
    gl_Position = volume < 0.0 ? clip_of(own.xyz) : NOT_SEEN;
}
