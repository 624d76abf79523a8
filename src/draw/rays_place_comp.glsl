/* Vertices of a volume as they stand on the picture, in double precision as on the processor: fine
 * layers far from the camera's focal point survive. */
layout(local_size_x = 64) in;
layout(std430, binding = 2) buffer verts_block {
    vec4 verts[]; /* x, y in pixels from the middle (perspective: times z), depth, value */
};
layout(std430, binding = 3) readonly buffer places_block {
    double places[];
};
uniform uint vert_count;
uniform dvec3 origin, right, up, forward;
uniform double frame_unit, frame_scale;

void main()
{
    for (uint v = gl_GlobalInvocationID.x; v < vert_count;
         v += gl_NumWorkGroups.x * gl_WorkGroupSize.x) {
        dvec3 from = dvec3(places[3u * v], places[3u * v + 1u], places[3u * v + 2u]) - origin;
        from /= frame_unit;
        verts[v].xyz = vec3(dot(from, right) * frame_scale, dot(from, up) * frame_scale,
                            dot(from, forward));
    }
}
