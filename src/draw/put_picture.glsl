/* Where fragments go: into a picture with a depth buffer. */
layout(location = 0) out vec4 color;
layout(location = 1) out vec4 depth;

void put(vec3 seen, float alpha, float z)
{
    if (!(z > depth_range.x) || z >= texelFetch(limit, ivec2(gl_FragCoord.xy), 0).r) discard;
    color = vec4(seen * alpha, alpha);
    depth = vec4(z, 0.0, 0.0, 1.0);
    gl_FragDepth = (z - depth_range.x) / (depth_range.y - depth_range.x);
}
