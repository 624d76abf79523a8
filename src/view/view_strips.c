/* Surfaces and planes of a model, patch by patch (tl_slices): of a cut that moves only the patches
 * that came are decoded. There are two strips of each surface, one of the cuts that limits made
 * coarser, for pictures while something moves, and one of those at rest, so that the one does not
 * take from the other what it goes on with. All of them go over to a cut together, so that a patch
 * that several of them meet is decoded once. */
#include "view/view.h"

/* What is sliced, and what is carried along. */
typedef struct cutting {
    tl_slices_opts opts;
    double value;
    uint32_t carried;
} cutting;

/* opts of it borrow from it. */
static void describe(const tl_view *view, const tli_agenda *agenda, const tli_entry *entry,
                     cutting *c)
{
    const tl_source *source = view->source;
    c->opts = tl_slices_opts_defaults();
    c->value = 0;
    c->carried = TL_NONE;
    if (entry->kind == TL_NODE_SURFACE) {
        c->opts.channel = tli_source_channel(source, agenda->step, entry->own->values.channel);
        c->value = tli_surface_value(agenda->scene, entry);
    } else {
        tl_scene_plane(agenda->scene, entry->node, "plane", c->opts.plane);
        c->opts.normals = false;
    }
    if (entry->color)
        c->carried = tli_source_channel(source, agenda->step, entry->color->values.channel);
    c->opts.values = &c->value;
    c->opts.value_count = 1;
    c->opts.channels = &c->carried;
    c->opts.channel_count = entry->color ? 1 : 0;
}

static tli_recipe recipe_of(const cutting *c, const tli_entry *entry)
{
    tli_recipe recipe = tli_recipe_count(4, c->opts.channel);
    recipe = tli_recipe_bytes(recipe, c->opts.plane, sizeof c->opts.plane);
    recipe = tli_recipe_real(recipe, c->value);
    recipe = tli_recipe_count(recipe, c->carried);
    if (!entry->color) return recipe;
    recipe = tli_recipe_count(recipe, entry->color->values.logarithmic);
    return tli_recipe_real(recipe, entry->color->factor);
}

/* What is drawn of a value, before it is linear between vertices. */
static double carry(const void *user, size_t place, const double *value, uint32_t components)
{
    const tli_strip *strip = user;
    const tl_channel one = {.components = components, .values = value};
    (void)place;
    return tli_shown(strip->logarithmic, strip->factor, tli_length_at(&one, 0));
}

static void release_strip(tl_ctx *ctx, tli_strip *strip)
{
    if (!strip) return;
    tl_slices_destroy(strip->slices);
    tl_mem_free(ctx, strip);
}

static tl_status create_strip(tl_ctx *ctx, tl_view *view, const tli_entry *entry, cutting *c,
                              tli_strip **strip)
{
    tl_status st = TL_OK;
    view->strips =
        tl_mem_resize(ctx, view->strips, view->strip_count + 1, sizeof *view->strips, &st);
    tli_strip *made = tl_mem_zalloc(ctx, 1, sizeof *made, &st);
    if (st) return st;
    *made = (tli_strip){.recipe = recipe_of(c, entry), .is_draft = view->is_draft, .factor = 1};
    if (entry->color) {
        made->logarithmic = entry->color->values.logarithmic;
        made->factor = entry->color->factor;
    }
    c->opts.carry = carry;
    c->opts.carry_user = made;
    st = tl_slices_create(ctx, view->source->store, &c->opts, &made->slices);
    if (st)
        release_strip(ctx, made);
    else
        *strip = view->strips[view->strip_count++] = made;
    return st;
}

static tli_strip *find_strip(const tl_view *view, tli_recipe recipe)
{
    for (size_t i = 0; i < view->strip_count; i++)
        if (view->strips[i]->recipe == recipe && view->strips[i]->is_draft == view->is_draft)
            return view->strips[i];
    return NULL;
}

static bool is_listed(tl_slices *const *slices, size_t count, const tl_slices *one)
{
    bool found = false;
    for (size_t i = 0; i < count; i++) found |= slices[i] == one;
    return found;
}

tl_status tli_strips_update(tli_maker *maker, const tli_entry *const *entries, size_t entry_count)
{
    tl_view *view = maker->view;
    tl_status st = TL_OK;
    size_t patch_count, decoded = 0, count = 0;
    const uint32_t *patches = tl_cut_patches(view->cut, &patch_count);
    tl_slices **slices = tl_mem_alloc(maker->ctx, entry_count, sizeof *slices, &st);
    for (size_t i = 0; !st && i < entry_count; i++) {
        cutting c;
        describe(view, maker->agenda, entries[i], &c);
        tli_strip *strip = find_strip(view, recipe_of(&c, entries[i]));
        if (!strip) st = create_strip(maker->ctx, view, entries[i], &c, &strip);
        if (!st && !is_listed(slices, count, strip->slices)) slices[count++] = strip->slices;
    }
    if (!st) st = tl_slices_update_all(slices, count, patches, patch_count, &decoded);
    maker->content->facts.decoded += decoded;
    tl_mem_free(maker->ctx, slices);
    return st;
}

tl_status tli_strip_join(const tli_maker *maker, const tli_entry *entry, tl_polydata **triangles)
{
    cutting c;
    describe(maker->view, maker->agenda, entry, &c);
    const tli_strip *strip = find_strip(maker->view, recipe_of(&c, entry));
    TL_ASSERT(strip);
    return tl_slices_join(strip->slices, triangles);
}

void tli_strips_tidy(tl_view *view, const tli_agenda *agenda)
{
    size_t kept = 0;
    for (size_t s = 0; s < view->strip_count; s++) {
        bool is_wanted = false;
        for (size_t i = 0; agenda && agenda->by_patch && i < agenda->thing_count; i++) {
            cutting c;
            const tli_entry *entry = &agenda->things[i];
            if (!tli_shares(TLI_CUTS, entry)) continue;
            describe(view, agenda, entry, &c);
            is_wanted |= recipe_of(&c, entry) == view->strips[s]->recipe;
        }
        if (is_wanted)
            view->strips[kept++] = view->strips[s];
        else
            release_strip(view->ctx, view->strips[s]);
    }
    view->strip_count = kept;
}

uint64_t tli_strips_bytes(const tl_view *view)
{
    uint64_t bytes = 0;
    for (size_t s = 0; s < view->strip_count; s++)
        bytes += tl_slices_get_state(view->strips[s]->slices).bytes;
    return bytes;
}
