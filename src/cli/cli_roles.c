/* Which words of a command line name files, and that none of them is written over another: an
 * output replaces what stands under its name, and often holds less than what it was made of. */
#include <string.h>
#include <sys/stat.h>

#include "cli_options.h"

/* A word that is read and one that may be written in its place: the same, changed. */
static const struct {
    cli_id output, input;
} CHANGES[] = {{CLI_WRITE_SCENE, CLI_SCENE}, {CLI_WRITE_CAMERA, CLI_CAMERA}};

static bool may_change(cli_id output, cli_id input)
{
    for (size_t i = 0; i < sizeof CHANGES / sizeof *CHANGES; i++)
        if (CHANGES[i].output == output && CHANGES[i].input == input) return true;
    return false;
}

/* A file that is written under a name: its folder, and the file where it is there already. */
typedef struct target {
    const char *path, *name;
    struct stat folder, file;
    bool has_folder, has_file;
} target;

static target look(const char *path)
{
    target t = {.path = path};
    char folder[4096] = ".";
    const char *slash = strrchr(path, '/');
    t.name = slash ? slash + 1 : path;
    if (slash) snprintf(folder, sizeof folder, "%.*s/", (int)(slash - path), path);
    t.has_folder = stat(folder, &t.folder) == 0;
    t.has_file = stat(path, &t.file) == 0;
    return t;
}

static bool is_same(const struct stat *a, const struct stat *b)
{
    return a->st_dev == b->st_dev && a->st_ino == b->st_ino;
}

/* Whether two names are those of one regular file, or of one that is to come. Devices and pipes
 * take what is written by several. */
static bool meet(const target *a, const target *b)
{
    if (a->has_file && b->has_file) return S_ISREG(a->file.st_mode) && is_same(&a->file, &b->file);
    return !a->has_file && !b->has_file && a->has_folder && b->has_folder &&
           is_same(&a->folder, &b->folder) && strcmp(a->name, b->name) == 0;
}

static int check_input(const cli_args *args, const target *output, const char *text)
{
    const target input = look(text);
    if (!input.has_file || !meet(output, &input)) return CLI_DONE;
    return cli_misuse(args->verb, "'%s' would be written over '%s', which is read", output->path,
                      text);
}

/* FILE, CHANNEL:FILE or CHANNEL=FILE, where both may hold these signs. */
static int check_word(const cli_args *args, const target *output, const char *text)
{
    int failed = check_input(args, output, text);
    while (!failed && (text = strpbrk(text, ":=")) != NULL)
        failed = check_input(args, output, ++text);
    return failed;
}

static int check_option(const cli_args *args, const target *output, cli_id output_id,
                        const cli_option *option)
{
    int failed = CLI_DONE;
    const cli_value *value = &args->values[option->id];
    if (!value->given || may_change(output_id, option->id)) return CLI_DONE;
    if (option->type == CLI_TYPE_INPUT) return check_word(args, output, value->text);
    for (size_t i = 0; !failed && option->type == CLI_TYPE_INPUTS && i < value->item_count; i++)
        failed = check_word(args, output, value->items[i]);
    if (failed || option->type != CLI_TYPE_OUTPUT || option->id == output_id) return failed;
    const target other = look(value->text);
    if (!meet(output, &other)) return CLI_DONE;
    return cli_misuse(args->verb, "'%s' would be written twice: --%s needs another name",
                      value->text, option->name);
}

/* id: the option that names the output, CLI_ID_COUNT for an operand. */
static int check_output(const cli_args *args, const char *path, cli_id id)
{
    int failed = CLI_DONE;
    const target output = look(path);
    const cli_verb *verb = args->verb;
    const bool are_apart = !verb->word && !verb->may_replace;
    for (size_t i = 0; !failed && are_apart && i < args->operand_count; i++)
        if (i + 1 != verb->operand_output) failed = check_input(args, &output, args->operands[i]);
    for (size_t g = 0; g < CLI_GROUPS_MAX && verb->groups[g]; g++)
        for (size_t i = 0; !failed && i < verb->groups[g]->option_count; i++)
            failed = check_option(args, &output, id, &verb->groups[g]->options[i]);
    return failed;
}

int cli_roles_check(const cli_args *args)
{
    int failed = CLI_DONE;
    const cli_verb *verb = args->verb;
    if (verb->operand_output && args->operand_count >= verb->operand_output)
        failed = check_output(args, args->operands[verb->operand_output - 1], CLI_ID_COUNT);
    for (size_t g = 0; g < CLI_GROUPS_MAX && verb->groups[g]; g++)
        for (size_t i = 0; !failed && i < verb->groups[g]->option_count; i++) {
            const cli_option *option = &verb->groups[g]->options[i];
            const cli_value *value = &args->values[option->id];
            if (option->type == CLI_TYPE_OUTPUT && value->given)
                failed = check_output(args, value->text, option->id);
        }
    return failed;
}
