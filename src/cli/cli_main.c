/* The program tetralod: picks the verb. What a verb takes and does stands in its own file. */
#include <stdio.h>
#include <string.h>

#include "cli_options.h"
#include "cli_session.h"

enum { VERBS_MAX = 32 };

static const cli_verb *find_verb(const char *name)
{
    for (size_t i = 0; cli_verbs[i]; i++)
        if (strcmp(cli_verbs[i]->name, name) == 0) return cli_verbs[i];
    return NULL;
}

static int unknown_verb(const char *name)
{
    const char *words[VERBS_MAX + 1];
    size_t count = 0;
    for (; cli_verbs[count] && count < VERBS_MAX; count++) words[count] = cli_verbs[count]->name;
    words[count++] = "help";
    const char *near = cli_nearest(name, words, count);
    if (near) return cli_misuse(NULL, "unknown verb '%s'; did you mean '%s'?", name, near);
    return cli_misuse(NULL, "unknown verb '%s'", name);
}

/* tetralod help [VERB|scene|--markdown] */
static int help(int argc, char **argv)
{
    if (argc > 1) return cli_misuse(NULL, "'%s' is one too many for help", argv[1]);
    if (argc == 0) {
        cli_help_program(stdout);
    } else if (strcmp(argv[0], "--markdown") == 0) {
        cli_help_markdown(stdout);
    } else if (strcmp(argv[0], "scene") == 0) {
        cli_help_scene(stdout);
    } else {
        const cli_verb *verb = find_verb(argv[0]);
        if (!verb) return unknown_verb(argv[0]);
        cli_help_verb(stdout, verb);
    }
    return CLI_DONE;
}

int main(int argc, char **argv)
{
    const char *word = argc > 1 ? argv[1] : NULL;
    if (!word) {
        cli_help_program(stderr);
        return CLI_WRONG_USE;
    }
    if (strcmp(word, "--help") == 0 || strcmp(word, "-h") == 0 || strcmp(word, "help") == 0) {
        int exit_status = help(argc - 2, argv + 2);
        return fflush(stdout) && !exit_status ? CLI_FAILED : exit_status;
    }
    if (strcmp(word, "--version") == 0) {
        printf("tetralod %s\n", cli_version().s);
        return fflush(stdout) ? CLI_FAILED : CLI_DONE;
    }
    if (word[0] == '-') return cli_misuse(NULL, "unknown option '%s' in place of a verb", word);
    const cli_verb *verb = find_verb(word);
    return verb ? cli_session_run(verb, argc - 2, argv + 2) : unknown_verb(word);
}
