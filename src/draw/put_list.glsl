/* Where fragments go: into the lists of their pixels, later things and pieces with larger tags. */
layout(std430, binding = 2) writeonly buffer colors_block {
    vec4 node_colors[]; /* of nodes, times opacity */
};
uniform int row_pixels, first_tag;

void put(vec3 seen, float alpha, float z)
{
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    if (!(z > depth_range.x) || z >= texelFetch(limit, pixel, 0).r) discard;
    uint node = list_add(uint(pixel.y * row_pixels + pixel.x), z, uint(first_tag + gl_PrimitiveID));
    if (node != NONE) node_colors[node] = vec4(seen * alpha, alpha);
}
