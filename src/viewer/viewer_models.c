/* Models that are built of what is open, or before a large mesh is read: the questions, where a
 * model is put, and the one that is there already. The live view does the work. */
#include "viewer_core.h"

#include <glib/gstdio.h>
#include <string.h>
#include <unistd.h>

/* From so many bytes on a mesh is not read before it was asked whether to build a model of it. */
#define LARGE_BYTES (256 * 1000 * 1000)
/* From so many tets on a model is proposed. */
#define MANY_TETS 400000

static const tl_node DATA = TL_NODE_DATA + 1;

struct viewer_models {
    char *building, *built_from; /* model that is being built, and of what; NULL: none */
    bool of_all;                 /* steps */
    char *asked;                 /* path that a question is about */
    char *found;                 /* a model of it that is there */
};

bool viewer_models_idle(const viewer *v)
{
    return !v->models->building;
}

/* ---- the one that is there ---- */

/* "dir/name.tlod" of "dir/name.vtu" and of the folder "dir/name". */
static char *name_beside(const char *path)
{
    char *stem = viewer_stem(path), *folder = g_path_get_dirname(path);
    char *name = g_strconcat(stem, ".tlod", NULL);
    char *whole = g_build_filename(folder, name, NULL);
    g_free(name);
    g_free(folder);
    g_free(stem);
    return whole;
}

/* A folder of the user's own, for models of what lies where nothing can be written. */
static char *own_folder(void)
{
    return g_build_filename(g_get_user_data_dir(), "tetralod", "models", NULL);
}

/* The name there has a number of the whole path, since files of several folders have one name. */
static char *name_in_own(const char *path)
{
    char *folder = own_folder(), *beside = name_beside(path);
    char *base = g_path_get_basename(beside);
    char *name = g_strdup_printf("%.*s-%08x.tlod", (int)(strlen(base) - strlen(".tlod")), base,
                                 g_str_hash(path));
    char *whole = g_build_filename(folder, name, NULL);
    g_free(name);
    g_free(base);
    g_free(beside);
    g_free(folder);
    return whole;
}

/* Takes over name: NULL unless a model is there that is not older than the data. */
static char *if_current(viewer *v, char *name, const char *path)
{
    GStatBuf model, data;
    const bool is_current = g_stat(name, &model) == 0 && g_stat(path, &data) == 0 &&
                            model.st_mtime >= data.st_mtime && tl_store_is(v->ctx, name);
    if (is_current) return name;
    g_free(name);
    return NULL;
}

/* tets: of the data, 0: not known. NULL: there is none. */
static char *find_model(viewer *v, const char *path, uint64_t tets)
{
    tl_store *store = NULL;
    char *name = if_current(v, name_beside(path), path);
    if (!name) name = if_current(v, name_in_own(path), path);
    if (!name || !tets) return name;
    const bool is_same =
        !tl_store_open(v->ctx, name, &store) && tl_store_get_head(store)->input_tets == tets;
    tl_store_close(store);
    tl_ctx_clear(v->ctx);
    if (is_same) return name;
    g_free(name);
    return NULL;
}

static bool can_write(const char *folder)
{
    return access(folder, W_OK) == 0;
}

/* ---- building ---- */

static void cancel_model(viewer *v)
{
    tl_live_cancel(v->live, TL_LIVE_MODEL);
}

/* Of all steps that there are, or of the one that is shown. */
static bool build(viewer *v, const char *input, const char *output, bool all)
{
    struct viewer_models *models = v->models;
    tl_read_opts read = tl_read_opts_defaults();
    const char *from = input;
    const tl_source_facts *facts = v->source ? tl_source_get_facts(v->source) : NULL;
    const bool is_open = facts && g_strcmp0(v->path, input) == 0;
    if (!viewer_may_write(v, output)) return false;
    for (size_t i = 0; !all && is_open && i < facts->step_count; i++) {
        const double shown = tl_scene_real(v->scene, DATA, "step");
        const tl_source_step *step = &facts->steps[i];
        if (shown < 0 ? i != facts->own_step : shown != (double)step->number) continue;
        if (step->file)
            from = step->file;
        else
            read.step = step->number;
    }
    const tl_status st = tl_live_build_model(v->live, from, &read, all, output, NULL);
    if (st) {
        viewer_say(v, VIEWER_ERROR, "A model can't be built now: %s", tl_status_name(st));
        return false;
    }
    g_free(models->building);
    g_free(models->built_from);
    models->building = g_strdup(output);
    models->built_from = g_strdup(input);
    models->of_all = all;
    viewer_window_progress(v, "Building a model", -1, cancel_model);
    viewer_window_retitle(v);
    return true;
}

static void ask_place(viewer *v, const char *input);

static void on_place(GtkNativeDialog *dialog, int response, viewer *v)
{
    char *path = response == GTK_RESPONSE_ACCEPT ? viewer_dialog_path(dialog) : NULL;
    const char *steps = gtk_file_chooser_get_choice(GTK_FILE_CHOOSER(dialog), "steps");
    const bool all = steps && strcmp(steps, "all") == 0;
    g_object_unref(dialog);
    if (!path) return;
    char *folder = g_path_get_dirname(path), *input = g_strdup(v->models->asked);
    if (can_write(folder)) {
        build(v, input, path, all);
    } else {
        viewer_say(v, VIEWER_WARNING, "Nothing can be written into '%s': choose another folder.",
                   folder);
        ask_place(v, input);
    }
    g_free(input);
    g_free(folder);
    g_free(path);
}

/* Whether a file may have several steps: known where it is open, else by its kind. */
static bool may_have_steps(const viewer *v, const char *input)
{
    if (v->source && g_strcmp0(v->path, input) == 0)
        return tl_source_get_facts(v->source)->step_count > 1;
    if (g_file_test(input, G_FILE_TEST_IS_DIR)) return true;
    for (size_t i = 0; tl_format_get(i); i++) {
        const tl_format *format = tl_format_get(i);
        char **endings = g_strsplit(format->endings, " ", -1);
        bool is_it = false;
        for (int k = 0; format->series && endings[k]; k++)
            is_it |= *endings[k] && g_str_has_suffix(input, endings[k]);
        g_strfreev(endings);
        if (is_it) return true;
    }
    return false;
}

static void ask_place(viewer *v, const char *input)
{
    static const char *STEPS[] = {"all", "one", NULL};
    static const char *LABELS[] = {"all of them, with a slider", "the one that is shown", NULL};
    char *beside = name_beside(input), *folder = g_path_get_dirname(beside);
    if (!can_write(folder)) {
        g_free(beside);
        g_free(folder);
        beside = name_in_own(input);
        folder = own_folder();
        g_mkdir_with_parents(folder, 0700);
    }
    char *name = g_path_get_basename(beside), *asked = g_strdup(input);
    g_free(v->models->asked);
    v->models->asked = asked;
    GtkFileChooserNative *dialog =
        viewer_dialog(v, "Build a model", "_Build", GTK_FILE_CHOOSER_ACTION_SAVE, name, folder);
    if (may_have_steps(v, input)) {
        gtk_file_chooser_add_choice(GTK_FILE_CHOOSER(dialog), "steps", "Time steps", STEPS, LABELS);
        gtk_file_chooser_set_choice(GTK_FILE_CHOOSER(dialog), "steps", "all");
    }
    g_signal_connect(dialog, "response", G_CALLBACK(on_place), v);
    gtk_native_dialog_show(GTK_NATIVE_DIALOG(dialog));
    g_free(name);
    g_free(beside);
    g_free(folder);
}

static void build_of_open(viewer *v)
{
    if (v->path) ask_place(v, v->path);
}

static void build_model(viewer *v)
{
    if (!v->source || tl_source_get_facts(v->source)->is_model)
        viewer_say(v, VIEWER_INFO, "Open a mesh first: a model is built of it.");
    else if (!viewer_models_idle(v))
        viewer_say(v, VIEWER_INFO, "A model is being built; build the next one after that.");
    else
        build_of_open(v);
}

/* ---- questions before a large mesh is read ---- */

enum { ANSWER_OPEN = 1, ANSWER_BUILD = 2, ANSWER_FOUND = 3 };

static void on_answer(GtkDialog *dialog, int answer, viewer *v)
{
    char *path = g_strdup(v->models->asked), *found = g_strdup(v->models->found);
    gtk_window_destroy(GTK_WINDOW(dialog));
    if (answer == ANSWER_OPEN) viewer_open(v, path, NULL);
    if (answer == ANSWER_BUILD) ask_place(v, path);
    if (answer == ANSWER_FOUND) viewer_open(v, found, NULL);
    g_free(found);
    g_free(path);
}

static void ask_how(viewer *v, const char *path, double bytes)
{
    struct viewer_models *models = v->models;
    char *name = g_path_get_basename(path), *size = viewer_bytes_text(bytes);
    g_free(models->asked);
    g_free(models->found);
    models->asked = g_strdup(path);
    models->found = find_model(v, path, 0);
    GtkWidget *dialog = gtk_message_dialog_new(
        v->window, GTK_DIALOG_MODAL | GTK_DIALOG_DESTROY_WITH_PARENT, GTK_MESSAGE_QUESTION,
        GTK_BUTTONS_NONE, models->found ? "Open the model of it?" : "Build a model first?");
    if (models->found)
        gtk_message_dialog_format_secondary_text(
            GTK_MESSAGE_DIALOG(dialog),
            "‘%s’ has %s, all of which would have to be read. ‘%s’ is a model of it.", name, size,
            models->found);
    else
        gtk_message_dialog_format_secondary_text(
            GTK_MESSAGE_DIALOG(dialog),
            "‘%s’ has %s. As it is, all of it has to be read each time, and fit in memory. A model "
            "is built once, in the background; then it opens at once and turns smoothly.",
            name, size);
    gtk_dialog_add_button(GTK_DIALOG(dialog), "_Cancel", GTK_RESPONSE_CANCEL);
    gtk_dialog_add_button(GTK_DIALOG(dialog), "Open as it _is", ANSWER_OPEN);
    gtk_dialog_add_button(GTK_DIALOG(dialog), "_Build a model", ANSWER_BUILD);
    if (models->found) gtk_dialog_add_button(GTK_DIALOG(dialog), "Open the _model", ANSWER_FOUND);
    gtk_dialog_set_default_response(GTK_DIALOG(dialog),
                                    models->found ? ANSWER_FOUND : ANSWER_BUILD);
    g_signal_connect(dialog, "response", G_CALLBACK(on_answer), v);
    gtk_window_present(GTK_WINDOW(dialog));
    g_free(name);
    g_free(size);
}

bool viewer_models_ask(viewer *v, const char *path)
{
    GStatBuf file;
    const bool is_large = g_stat(path, &file) == 0 && S_ISREG(file.st_mode) &&
                          file.st_size > LARGE_BYTES && !tl_store_is(v->ctx, path);
    if (is_large) ask_how(v, path, (double)file.st_size);
    return is_large;
}

static void open_found(viewer *v)
{
    if (v->models->found) viewer_open_as_shown(v, v->models->found, true);
}

static void build_of_refused(viewer *v)
{
    if (v->models->asked) ask_place(v, v->models->asked);
}

void viewer_models_offer(viewer *v, const char *path, const char *text)
{
    g_free(v->models->asked);
    v->models->asked = g_strdup(path);
    viewer_offer(v, "Build a model…", build_of_refused, NULL,
                 "%s\nA model of it opens whatever its size.", text);
}

/* A mesh of many tets is open. */
static void on_source(viewer *v, void *user)
{
    (void)user;
    struct viewer_models *models = v->models;
    const tl_source_facts *facts = tl_source_get_facts(v->source);
    if (facts->is_model || facts->tets < MANY_TETS || v->words->script) return;
    char *tets = viewer_count_text((double)facts->tets);
    g_free(models->found);
    models->found = find_model(v, v->path, facts->tets);
    if (models->found)
        viewer_offer(v, "Open the model", open_found, NULL,
                     "A mesh of %s tets. '%s' is a model of it: that opens at once and turns "
                     "smoothly.",
                     tets, models->found);
    else
        viewer_offer(v, "Build a model…", build_of_open, NULL,
                     "A mesh of %s tets. As a model it opens at once and turns smoothly.", tets);
    g_free(tets);
}

/* ---- what the live view says ---- */

static void on_end(viewer *v, const tl_live_event *event)
{
    struct viewer_models *models = v->models;
    char *built = g_steal_pointer(&models->building);
    viewer_window_progress(v, NULL, 0, NULL);
    if (event->kind == TL_LIVE_DONE) {
        viewer_say(v, VIEWER_INFO, "The model '%s' is complete.", built);
        if (v->path && g_strcmp0(v->path, models->built_from) == 0)
            viewer_open_as_shown(v, built, models->of_all);
        else
            viewer_open(v, built, NULL);
    } else if (event->status != TL_ERR_CANCELLED) {
        viewer_say(v, VIEWER_ERROR, "%s", event->text);
    }
    g_free(built);
    viewer_window_retitle(v);
}

static void on_live(viewer *v, void *user)
{
    (void)user;
    const tl_live_event *event = v->event;
    if (event->job != TL_LIVE_MODEL) return;
    if (event->kind == TL_LIVE_PROGRESS)
        viewer_window_job(v, "Building a model", event, cancel_model);
    else if (event->kind == TL_LIVE_DONE || event->kind == TL_LIVE_FAILED)
        on_end(v, event);
}

/* ---- the part ---- */

/* The steps that there are: all, one. */
static bool run_build(viewer *v, const char *arguments)
{
    const char *file = arguments;
    const bool one = g_str_has_prefix(arguments, "one ");
    if (one || g_str_has_prefix(arguments, "all ")) file += 4;
    return v->path && build(v, v->path, file, !one);
}

static bool run_find_model(viewer *v, const char *arguments)
{
    (void)arguments;
    const tl_source_facts *facts = v->source ? tl_source_get_facts(v->source) : NULL;
    char *found = facts && !facts->is_model ? find_model(v, v->path, facts->tets) : NULL;
    g_print("%s\n", found ? found : "none");
    g_free(found);
    return true;
}

static const viewer_action ACTIONS[] = {
    {"build-model", "<Control>b", "File", "Build a model of the mesh", build_model, NULL},
};
static const viewer_command COMMANDS[] = {
    {"build", "build [all|one] FILE.tlod", run_build},
    {"find-model", "find-model", run_find_model},
};

void viewer_models_create(viewer *v)
{
    v->models = g_new0(struct viewer_models, 1);
}

void viewer_models_attach(viewer *v)
{
    viewer_add_actions(v, ACTIONS, G_N_ELEMENTS(ACTIONS));
    viewer_add_commands(v, COMMANDS, G_N_ELEMENTS(COMMANDS));
    viewer_listen(v, VIEWER_LIVE, on_live, NULL);
    viewer_listen(v, VIEWER_SOURCE, on_source, NULL);
}

void viewer_models_destroy(viewer *v)
{
    g_free(v->models->building);
    g_free(v->models->built_from);
    g_free(v->models->asked);
    g_free(v->models->found);
    g_free(v->models);
}
