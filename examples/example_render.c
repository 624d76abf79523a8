/* Draws a model off screen: example_render MODEL.tlod OUT.png [COMMAND]... Commands are those of
 * scenes, "add surface channel=pressure value=0.3", "view 30,20"; without any it is a first look.
 */
#include <stdio.h>

#include "tetralod/tetralod.h"

enum { WIDTH = 800, HEIGHT = 600 };

/* What is shown: by commands, or what the library takes to be worth a look. */
static tl_status fill_scene(tl_ctx *ctx, tl_source *source, tl_scene *scene, char **commands)
{
    tl_status status = tl_scene_set_bounds(ctx, scene, tl_source_get_facts(source)->bounds);
    if (!status) status = tl_scene_set_frame(ctx, scene, WIDTH, HEIGHT, NULL);
    if (!status && !*commands) status = tl_first_look(ctx, source, scene);
    while (!status && *commands) status = tl_scene_do(ctx, scene, *commands++);
    return status;
}

int main(int argc, char **argv)
{
    if (argc < 3) {
        fprintf(stderr, "usage: example_render MODEL.tlod OUT.png [COMMAND]...\n");
        return 2;
    }
    tl_ctx *ctx = NULL;
    tl_source *source = NULL;
    tl_scene *scene = NULL;
    tl_view *view = NULL;
    tl_content *content = NULL; /* all that is drawn for a camera */
    tl_renderer *renderer = NULL;
    tl_shown *shown = NULL; /* what the renderer has of it */
    tl_image *image = NULL;
    tl_camera camera;

    tl_status status = tl_ctx_create(NULL, &ctx);
    if (!status) status = tl_source_open(ctx, argv[1], &source);
    if (!status) status = tl_scene_create(ctx, &scene);
    if (!status) status = fill_scene(ctx, source, scene, argv + 3);
    if (!status) status = tl_view_create(ctx, source, &view);
    if (!status) {
        tl_scene_camera(scene, WIDTH, HEIGHT, &camera);
        status = tl_view_build(ctx, view, scene, &camera, NULL, &content);
    }
    if (!status) status = tl_renderer_create(ctx, TL_RENDERER_CPU, &renderer);
    if (!status) status = tl_shown_create(ctx, renderer, &shown);
    if (!status) status = tl_content_show(ctx, shown, content);
    if (!status) status = tl_content_draw(ctx, shown, &camera, NULL, &image);
    if (!status) {
        tl_image_flatten(image, NULL);
        status = tl_image_write_png(ctx, image, argv[2]);
    }
    if (!status) {
        const tl_content_facts *facts = tl_content_get_facts(content);
        printf("%llu of %llu tets, off by %.2g pixels at most\n", (unsigned long long)facts->tets,
               (unsigned long long)facts->source_tets, facts->error_px);
    } else {
        fprintf(stderr, "%s: %s\n", tl_status_name(status), ctx ? tl_ctx_message(ctx) : "");
    }
    tl_image_destroy(ctx, image);
    tl_shown_destroy(ctx, shown);
    tl_renderer_destroy(ctx, renderer);
    tl_content_destroy(ctx, content);
    tl_view_destroy(view);
    tl_scene_destroy(ctx, scene);
    tl_source_destroy(source);
    tl_ctx_destroy(ctx);
    return status != TL_OK;
}
