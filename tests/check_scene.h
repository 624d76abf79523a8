/* Scenes of tests: one that has a node of every kind with values other than their presets, and what
 * is compared of scenes. */
#ifndef TETRALOD_TESTS_CHECK_SCENE_H
#define TETRALOD_TESTS_CHECK_SCENE_H

#include "check.h"

#include "tetralod/scene.h"

#include "check_ctx.h"

static const double CHECK_SCENE_BOUNDS[6] = {-1, 3, 10, 20, -5, -4};

/* Carries out commands up to a NULL. */
static inline void check_scene_do(tl_ctx *ctx, tl_scene *scene, const char *const *lines)
{
    for (; *lines; lines++) CHECK_OK(ctx, tl_scene_do(ctx, scene, *lines));
}

static inline tl_scene *check_scene_create(tl_ctx *ctx)
{
    tl_scene *scene = NULL;
    CHECK_OK(ctx, tl_scene_create(ctx, &scene));
    CHECK_OK(ctx, tl_scene_set_bounds(ctx, scene, CHECK_SCENE_BOUNDS));
    return scene;
}

/* A node of every kind. */
static inline tl_scene *check_scene_full(tl_ctx *ctx)
{
    static const char *const LINES[] = {
        "set data.regions \"steel, \\\"air\\\" \\\\ 3\"",
        "set camera.position 1 -2.5 1e-7",
        "set picture.title \"L\xc3\xa4ngs\"",
        "set picture.background none",
        "set detail.error_px 0.1",
        "set detail.tets 123456789",
        "add derive text=\"speed = mag(velocity)\"",
        "add clip plane=-y=30%",
        "add threshold channel=p low=0.30000000000000004",
        "add transfer channel=p colors=\"0,0,0,1 0.1,1,0,0 0.1,0,1,0\" opacities=\"0,0 1,0.5\"",
        "add volume channel=p lit=on",
        "add surface channel=p value=0.1 color=#3c6fb8 opacity=0.25",
        "add surface channel=q",
        "add slice plane=0,0,0,1,1,1",
        "add boundary mark=patches",
        "add edges",
        "add silhouettes width_px=2",
        "add points count=1000",
        "add lines channel=U has_box=yes box=0,0,0,1,1,1 speed=-2",
        NULL};
    tl_scene *scene = check_scene_create(ctx);
    check_scene_do(ctx, scene, LINES);
    return scene;
}

/* The scene as JSON: tl_mem_free. */
static inline char *check_scene_text(tl_ctx *ctx, const tl_scene *scene)
{
    char *text = NULL;
    size_t bytes = 0;
    CHECK_OK(ctx, tl_scene_write_text(ctx, scene, &text, &bytes));
    CHECK_EQ(strlen(text), bytes);
    return text;
}

static inline bool check_scene_says(tl_ctx *ctx, const tl_scene *scene, const char *expected)
{
    char *text = check_scene_text(ctx, scene);
    const bool is_equal = strcmp(text, expected) == 0;
    if (!is_equal) printf("is\n%s\nexpected\n%s\n", text, expected);
    tl_mem_free(ctx, text);
    return is_equal;
}

#define CHECK_MESSAGE(ctx, part)                                                                   \
    do {                                                                                           \
        if (!strstr(tl_ctx_message(ctx), part))                                                    \
            fail_msg("%s:%d: '%s' has no '%s'", __FILE__, __LINE__, tl_ctx_message(ctx), part);    \
    } while (0)

#endif
