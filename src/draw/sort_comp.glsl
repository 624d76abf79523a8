/* Puts the list of each pixel in order, nearest first, of equal depths the largest tag first: by
 * merging runs of 1, 2, 4 ... nodes. */
layout(local_size_x = 64) in;
uniform uint pixel_count;

bool comes_before(uint a, uint b)
{
    float za = uintBitsToFloat(nodes[3u * a + 1u]), zb = uintBitsToFloat(nodes[3u * b + 1u]);
    return za < zb || (za == zb && nodes[3u * a + 2u] > nodes[3u * b + 2u]);
}

/* Merges pairs of runs of a list; its new head. */
uint merge_runs(uint list, uint run, out bool is_sorted)
{
    uint head = NONE, tail = NONE, a = list, merges = 0u;
    while (a != NONE) {
        uint b = a, in_a = 0u, in_b = run;
        for (; in_a < run && b != NONE; in_a++) b = nodes[3u * b];
        while (in_a > 0u || (in_b > 0u && b != NONE)) {
            bool take_b = in_a == 0u || (in_b > 0u && b != NONE && comes_before(b, a));
            uint next = take_b ? b : a;
            if (take_b) {
                b = nodes[3u * b];
                in_b--;
            } else {
                a = nodes[3u * a];
                in_a--;
            }
            if (tail == NONE)
                head = next;
            else
                nodes[3u * tail] = next;
            tail = next;
        }
        a = b;
        merges++;
    }
    nodes[3u * tail] = NONE;
    is_sorted = merges <= 1u;
    return head;
}

void main()
{
    for (uint pixel = gl_GlobalInvocationID.x; pixel < pixel_count;
         pixel += gl_NumWorkGroups.x * gl_WorkGroupSize.x) {
        uint list = heads[pixel];
        bool is_sorted = list == NONE || nodes[3u * list] == NONE;
        for (uint run = 1u; !is_sorted; run *= 2u) list = merge_runs(list, run, is_sorted);
        heads[pixel] = list;
    }
}
