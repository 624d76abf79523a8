/* Lists of what lies at each pixel, filled in any order: of node i its follower, its depth as bits,
 * and a tag stand at 3 i. More nodes than there is room for are counted and left out. */
const uint NONE = 0xffffffffu;
layout(std430, binding = 0) buffer heads_block {
    uint node_count, node_max, given_up, not_used;
    uint heads[]; /* of pixels, row after row from below */
};
layout(std430, binding = 1) buffer nodes_block {
    uint nodes[];
};

/* Puts a node at the head of a pixel's list; NONE: there is no room. */
uint list_add(uint pixel, float z, uint tag)
{
    uint node = atomicAdd(node_count, 1u);
    if (node >= node_max) return NONE;
    nodes[3u * node] = atomicExchange(heads[pixel], node);
    nodes[3u * node + 1u] = floatBitsToUint(z);
    nodes[3u * node + 2u] = tag;
    return node;
}
