/* What the threads share: counted objects, the lock with its hook, what is to be drawn. */
#include <math.h>
#include <string.h>

#include "cut/cut_camera.h"
#include "live/live.h"

/* So many frames that are drawn too slowly while something moves are enough. */
enum { SLOW_FRAMES = 2 };

void tli_live_lock(tl_live *live)
{
    tli_lock_take(&live->lock);
}

void tli_live_unlock(tl_live *live)
{
    bool tells = live->tells && !live->is_ending;
    live->tells = false;
    tli_lock_give(&live->lock);
    if (tells && live->opts.notify) live->opts.notify(live->opts.user);
}

void tli_live_tell(tl_live *live)
{
    live->tells = true;
    tli_bell_ring(&live->shell);
}

void tli_live_sleep(tl_live *live, tli_bell *bell, double seconds)
{
    if (live->tells) { /* waiting gives the lock without the hook */
        tli_live_unlock(live);
        tli_live_lock(live);
    } else if (isfinite(seconds)) {
        tli_bell_wait_for(bell, &live->lock, seconds);
    } else {
        tli_bell_wait(bell, &live->lock);
    }
}

/* ---- counted objects ---- */

void tli_live_drop_scene(tl_live *live, tli_live_scene *scene)
{
    if (!scene || --scene->holds) return;
    tl_scene_destroy(live->ctx, scene->scene);
    tl_mem_free(live->ctx, scene);
}

void tli_live_drop_source(tl_live *live, tli_live_source *source)
{
    if (!source || --source->holds) return;
    source->next = live->old_sources;
    live->old_sources = source;
    tli_bell_ring(&live->builder.bell);
}

void tli_live_drop_former(tl_live *live)
{
    while (live->former) {
        tli_live_source *source = live->former;
        live->former = source->next;
        tli_live_drop_source(live, source);
    }
}

void tli_live_drop_content(tl_live *live, tli_live_content *content)
{
    if (!content || --content->holds) return;
    content->next = live->old_contents;
    live->old_contents = content;
    tli_bell_ring(&live->builder.bell);
}

void tli_live_drop_slot(tl_live *live, tli_live_slot *slot)
{
    if (!slot || --slot->holds) return;
    tli_live_drop_content(live, slot->content);
    slot->content = NULL;
    tli_bell_ring(&live->drawer.bell); /* it may wait for one */
}

/* ---- scenes ---- */

/* Cameras and words on pictures need no other content. */
static bool changes_content(tl_node_kind kind)
{
    return kind != TL_NODE_CAMERA && kind != TL_NODE_PICTURE;
}

/* The step, and channels that are derived. */
static bool changes_values(tl_node_kind kind)
{
    return kind == TL_NODE_DATA || kind == TL_NODE_DERIVE;
}

static uint64_t stamp_of(const tl_scene *scene, bool (*counts)(tl_node_kind kind))
{
    size_t count = 0;
    const tl_node *nodes = tl_scene_nodes(scene, &count);
    uint64_t stamp = 0xcbf29ce484222325u; /* as of Fowler, Noll and Vo, by eight bytes */
    for (size_t i = 0; i < count; i++) {
        if (!counts(tl_scene_kind(scene, nodes[i]))) continue;
        stamp = (stamp ^ tl_scene_node_version(scene, nodes[i])) * 0x100000001b3u;
        stamp ^= stamp >> 29;
    }
    return stamp;
}

double tli_live_data_step(const tli_live_scene *scene)
{
    return tl_scene_real(scene->scene, TL_NODE_DATA + 1, "step");
}

tl_status tli_live_copy_scene(tl_live *live, const tl_scene *scene, tli_live_scene **copy)
{
    tl_status st = TL_OK;
    *copy = NULL;
    tli_live_scene *s = tl_mem_zalloc(live->ctx, 1, sizeof *s, &st);
    if (!st) st = tl_scene_copy(live->ctx, scene, &s->scene);
    if (st) {
        tl_mem_free(live->ctx, s);
        return st;
    }
    s->version = tl_scene_version(s->scene);
    s->stamp = stamp_of(s->scene, changes_content);
    s->values_stamp = stamp_of(s->scene, changes_values);
    s->holds = 1;
    *copy = s;
    return TL_OK;
}

static double detail(const tli_live_scene *scene, const char *prop)
{
    return tl_scene_real(scene->scene, TL_NODE_DETAIL + 1, prop);
}

void tli_live_show_scene(tl_live *live, tli_live_scene *scene)
{
    uint64_t ram = (uint64_t)detail(scene, "ram_bytes");
    uint64_t card = (uint64_t)detail(scene, "card_bytes");
    tli_live_drop_scene(live, live->scene);
    live->scene = scene;
    if (!ram) ram = live->opts.ram_bytes;
    if (ram != live->ram_limit) {
        live->fits_tets = UINT64_MAX;
        live->rays_max = (double)INFINITY;
        live->has_said_rays = false;
    }
    live->ram_limit = ram;
    if (!card) card = UINT64_MAX;
    if (card != live->card_limit) live->card_tets = UINT64_MAX;
    live->card_limit = card;
    tli_pace_ask(&live->pace, detail(scene, "frame_s"), (uint64_t)detail(scene, "moving_tets"));
}

/* ---- cameras ---- */

bool tli_live_camera(const tl_live *live, tl_camera *camera)
{
    if (!live->scene) return false;
    tl_scene_camera(live->scene->scene, live->width, live->height, camera);
    return true;
}

bool tli_live_same_camera(const tl_camera *a, const tl_camera *b)
{
    return tli_camera_is_same(a, b) && a->size_px[0] == b->size_px[0] &&
           a->size_px[1] == b->size_px[1];
}

/* ---- contents ---- */

uint64_t tli_live_room(const tl_live *live)
{
    return live->fits_tets < live->card_tets ? live->fits_tets : live->card_tets;
}

bool tli_live_is_final(const tl_live *live, const tli_live_content *content)
{
    tl_camera camera;
    if (!content || !tli_live_camera(live, &camera) || content->stamp != live->scene->stamp)
        return false;
    if (content->facts->is_model &&
        (content->step == TLI_LIVE_QUICK || !tli_live_same_camera(&camera, &content->camera)))
        return false;
    if (content->facts->is_complete) return true;
    /* no finer than there is room */
    return content->step == TLI_LIVE_FINE && content->tets_max >= tli_live_room(live);
}

double tli_live_off_px(const tl_live *live, tli_live_content *content, const tl_camera *camera)
{
    if (content->asked_px >= 0 && tli_live_same_camera(camera, &content->asked))
        return content->asked_px;
    content->asked = *camera;
    if (tl_content_error_px(live->ctx, content->content, camera, &content->asked_px))
        content->asked_px = (double)INFINITY; /* sees nothing; a failure comes with its drawing */
    return content->asked_px;
}

bool tli_live_is_coarser(const tl_live *live, tli_live_content *content, tli_live_content *other)
{
    tl_camera camera;
    if (!tli_live_camera(live, &camera)) return false;
    const double one = tli_live_off_px(live, content, &camera);
    const double two = tli_live_off_px(live, other, &camera);
    return one == two ? content->facts->whole_tets < other->facts->whole_tets : one > two;
}

bool tli_live_is_light(const tl_live *live, const tli_live_content *content)
{
    if (content->facts->tets <= live->pace.tets) return true;
    if (live->pace.tets_asked) return false; /* no more than that */
    return content->too_slow < SLOW_FRAMES && tli_pace_holds(&live->pace, content->rest_s);
}

tli_live_content *tli_live_best(const tl_live *live)
{
    tli_live_content *coarse = live->coarse, *fine = live->fine;
    if (!coarse || !fine) return coarse ? coarse : fine;
    uint64_t stamp = live->scene ? live->scene->stamp : 0;
    if (fine->stamp != coarse->stamp && (fine->stamp == stamp || coarse->stamp == stamp))
        return fine->stamp == stamp ? fine : coarse;
    if (live->moving && !tli_live_is_light(live, fine)) return coarse;
    /* all that is asked for, whatever came before */
    if (!live->moving && tli_live_is_final(live, fine)) return fine;
    if (!live->moving && tli_live_is_final(live, coarse)) return coarse;
    return tli_live_is_coarser(live, fine, coarse) ? coarse : fine;
}
