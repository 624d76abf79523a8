/* Corners of triangles. */
uniform usampler2D corners;
uniform sampler2D verts, normals; /* normals.w: value */
uniform mat3 turn;                /* from mesh units to right, up, forward */
uniform vec3 offset;              /* of the anchor, in units of the frame */
uniform bool has_normals;

out vec3 normal, at; /* right, up, forward */
out float value;

vec3 vert(int i)
{
    return texelFetch(verts, place(int(texelFetch(corners, place(i), 0).r)), 0).xyz;
}

void main()
{
    int first = gl_VertexID / 3 * 3, own = int(texelFetch(corners, place(gl_VertexID), 0).r);
    vec3 a = vert(first), b = vert(first + 1), c = vert(first + 2);
    vec4 carried = texelFetch(normals, place(own), 0);
    vec3 flat_normal = cross(b - a, c - a);
    value = carried.w;
    normal = turn * (has_normals ? carried.xyz : flat_normal);
    at = turn * texelFetch(verts, place(own), 0).xyz + offset;
    /* without area, or not finite: not seen */
    gl_Position = dot(flat_normal, flat_normal) > 0.0 ? clip_of(vec3(at.xy * scale, at.z))
                                                      : NOT_SEEN;
}
