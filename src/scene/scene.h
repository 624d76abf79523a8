/* Stage scene, internal: what its files share. A scene is a list of states, each a list of nodes;
 * states share nodes, nothing of either changes once it is made. A change makes a node, then a
 * state, and only then touches the scene: whatever fails before leaves it as it was. */
#ifndef TETRALOD_SRC_SCENE_H
#define TETRALOD_SRC_SCENE_H

#include "base/base.h"
#include "tetralod/scene.h"

enum {
    TLI_PROPS_MAX = 24,   /* of a kind */
    TLI_GROUPS_MAX = 8,   /* in each other */
    TLI_STEP_BYTES = 128, /* name of a step */
    TLI_REAL_BYTES = 32,  /* a number as text */
    TLI_WHERE_BYTES = 256 /* what a message is about, "surface1.value", "things[2].value" */
};

/* Values, their reals and texts in one block. */
typedef struct tli_node {
    size_t refs;
    tl_node number;
    tl_node_kind kind;
    uint64_t version;
    char name[TL_SCENE_NAME_BYTES];
    size_t prop_count;
    tl_value values[];
} tli_node;

typedef struct tli_state {
    size_t refs;
    uint64_t version;
    char step[TLI_STEP_BYTES]; /* what led to it; "": the first */
    bool merges;               /* a step of the same name goes on with it */
    size_t node_count;
    tli_node *nodes[];
} tli_state;

struct tl_scene {
    tli_state *now;
    tli_state *states[TL_SCENE_STEPS_MAX + 1]; /* [state_count] */
    size_t state_count, at;                    /* states[at] is now, outside of groups */
    bool sealed;
    tli_state *before[TLI_GROUPS_MAX]; /* [depth] groups that were begun */
    size_t depth;
    char group[TLI_STEP_BYTES];          /* the outermost one */
    tl_node next;                        /* number of the next node */
    tl_node numbers[TL_SCENE_NODES_MAX]; /* of now */
    double bounds[6], window[4];
    uint32_t size_px[2];
};

/* ---- scene_table.c ---- */

bool tli_prop_may_be_empty(const tl_prop_info *info);

/* ---- values: scene_value.c ---- */

/* Completes a value (choices get index and word, flags 0 or 1) and checks it. A failure has that
 * status and says where, and what is expected. */
tl_status tli_value_check(tl_ctx *ctx, tl_status failure, const tl_prop_info *info,
                          const char *where, tl_value *value);
/* Fails, saying what is expected of a property. */
tl_status tli_value_fail(tl_ctx *ctx, tl_status failure, const tl_prop_info *info,
                         const char *where);
/* A number in the fewest digits that give it again, whatever the locale. */
void tli_real_print(double real, char text[TLI_REAL_BYTES]);

/* ---- words: scene_words.c ---- */

/* Reads text as a value, unchecked; reals come from the arena, words are borrowed. bounds: for
 * planes. TL_ERR_ARG. */
tl_status tli_value_parse(tli_arena *arena, const double bounds[6], const tl_prop_info *info,
                          const char *where, const char *text, tl_value *value);

/* ---- nodes and states: scene_object.c ---- */

/* What a new node of a kind has; reals come from the arena. */
tl_status tli_node_presets(tli_arena *arena, tl_node_kind kind, tl_value values[TLI_PROPS_MAX]);
/* The place of a node, and of a property; SIZE_MAX if there is none. */
size_t tli_scene_place(const tl_scene *scene, tl_node node);
size_t tli_prop_index(tl_node_kind kind, const char *prop);
/* Borrowed until the next change; NULL if node or property is not there. */
const tl_value *tli_scene_value(const tl_scene *scene, tl_node node, const char *prop);
/* Whether a node may have the name; the message of TL_ERR_ARG or failure says where. */
tl_status tli_name_check(tl_ctx *ctx, const tl_scene *scene, tl_status failure, const char *where,
                         const char *name);
/* Adds a node with a name (NULL: the next free one) and checked values. */
tl_status tli_scene_put_new(tl_ctx *ctx, tl_scene *scene, tl_node_kind kind, const char *name,
                            const tl_value *values, tl_node *node);
/* Gives a node checked values; step NULL: "set NAME". */
tl_status tli_scene_put(tl_ctx *ctx, tl_scene *scene, tl_node node, const tl_value *values,
                        const char *step);
/* Fails if another transfer node than the one at a place has the channel. */
tl_status tli_transfer_check(tl_ctx *ctx, const tl_scene *scene, tl_status failure,
                             const char *where, size_t place, const char *channel);

/* ---- steps: scene_steps.c ---- */

/* Makes the state current as a step of its name; takes it over. */
void tli_scene_commit(tl_ctx *ctx, tl_scene *scene, tli_state *state);
void tli_state_release(tl_ctx *ctx, tli_state *state);

#endif
