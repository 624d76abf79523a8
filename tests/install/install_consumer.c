/* A program of somebody else: uses the installed library alone. Writes a small sample to the path
 * that it is given, reads it again, and prints the linked version and the number of tets. */
#include <stdio.h>
#include <tetralod/tetralod.h>

int main(int argc, char **argv)
{
    tl_ctx *ctx = NULL;
    tl_mesh *mesh = NULL;
    if (argc != 2) return 2;
    tl_status st = tl_ctx_create(NULL, &ctx);
    if (!st) st = tl_sample_write(ctx, "marschner-lobb", 5, argv[1]);
    if (!st) st = tl_mesh_read(ctx, argv[1], NULL, &mesh, NULL);
    if (st)
        fprintf(stderr, "%s: %s\n", tl_status_name(st), ctx ? tl_ctx_message(ctx) : "");
    else
        printf("version %d, %zu tets\n", tl_version(), tl_mesh_tet_count(mesh));
    tl_mesh_destroy(mesh);
    tl_ctx_destroy(ctx);
    return st != TL_OK;
}
