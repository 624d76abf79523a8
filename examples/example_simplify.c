/* Simplifies a mesh to a tenth of its tets: example_simplify IN OUT. */
#include <stdio.h>

#include "tetralod/tetralod.h"

int main(int argc, char **argv)
{
    if (argc != 3) {
        fprintf(stderr, "usage: example_simplify IN OUT\n");
        return 2;
    }
    tl_ctx *ctx = NULL;
    tl_mesh *fine = NULL, *coarse = NULL;
    tl_simplify_result result = {0};
    tl_simplify_opts opts = tl_simplify_opts_defaults();
    opts.ratio = 0.1;

    tl_status status = tl_ctx_create(NULL, &ctx);
    if (!status) status = tl_mesh_read(ctx, argv[1], NULL, &fine, NULL);
    if (!status) status = tl_mesh_simplify(ctx, fine, &opts, &coarse, &result);
    if (!status) status = tl_mesh_write(ctx, coarse, argv[2], NULL);
    if (!status) {
        printf("%zu tets from %zu\n", result.tets_out, result.tets_in);
        for (size_t i = 0; i < result.channel_count; i++)
            printf("%s: at most %g off\n", result.channels[i].name, result.channels[i].max_error);
    } else {
        fprintf(stderr, "%s: %s\n", tl_status_name(status), ctx ? tl_ctx_message(ctx) : "");
    }
    tl_simplify_release(ctx, &result);
    tl_mesh_destroy(coarse);
    tl_mesh_destroy(fine);
    tl_ctx_destroy(ctx);
    return status != TL_OK;
}
