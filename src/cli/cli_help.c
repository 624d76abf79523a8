/* Prints the option tables: as help on a terminal and as docs/CLI.md. */
#include "cli_options.h"

#include <ctype.h>
#include <string.h>

/* Columns of a help text on a terminal, and where the explanation of an option starts. */
#define HELP_COLUMNS 92
#define HELP_INDENT 28

static const char *const ABOUT =
    "tetralod shows tetrahedral volume meshes at any level of detail, at a known error.";
static const char *const RULES =
    "Results go to stdout, messages to stderr. Exit status: 0 done, 1 failed, 2 wrong use.";

/* Prints text from column on, broken between words, continued lines at indent. */
static void print_wrapped(FILE *out, const char *text, size_t column, size_t indent)
{
    while (*text) {
        size_t length = strcspn(text, " ");
        if (column > indent && column + 1 + length > HELP_COLUMNS) {
            fprintf(out, "\n%*s", (int)indent, "");
            column = indent;
        } else if (column > indent) {
            fputc(' ', out);
            column++;
        }
        fwrite(text, 1, length, out);
        column += length;
        text += length + (text[length] == ' ');
    }
    fputc('\n', out);
}

/* "-o, --output FILE" */
static void option_title(const cli_option *option, char *title, size_t title_bytes)
{
    char letter[8] = "";
    if (option->letter) snprintf(letter, sizeof letter, "-%c, ", option->letter);
    snprintf(title, title_bytes, "%s--%s%s%s", letter, option->name, option->meta ? " " : "",
             option->meta ? option->meta : "");
}

/* The sentence of an option with its default. */
static void option_text(const cli_option *option, char *text, size_t text_bytes)
{
    int n = snprintf(text, text_bytes, "%s", option->help);
    if (n < 0 || (size_t)n >= text_bytes) return;
    if (option->type == CLI_TYPE_LIST || option->type == CLI_TYPE_INPUTS)
        n += snprintf(text + n, text_bytes - (size_t)n, " (repeatable)");
    if (option->initial && (size_t)n < text_bytes)
        snprintf(text + n, text_bytes - (size_t)n, " (default %s)", option->initial);
}

/* A title at the left and its text beside it. */
static void print_titled(FILE *out, const char *title, const char *text)
{
    int column = fprintf(out, "  %s", title);
    if (column + 2 > HELP_INDENT)
        fprintf(out, "\n%*s", HELP_INDENT, "");
    else
        fprintf(out, "%*s", HELP_INDENT - column, "");
    print_wrapped(out, text, HELP_INDENT, HELP_INDENT);
}

static void print_option(FILE *out, const cli_option *option)
{
    char title[96], text[1024];
    option_title(option, title, sizeof title);
    option_text(option, text, sizeof text);
    print_titled(out, title, text);
}

void cli_help_program(FILE *out)
{
    fprintf(out, "%s\n\nUsage: tetralod VERB ...\n\n", ABOUT);
    for (size_t i = 0; cli_verbs[i]; i++)
        fprintf(out, "  %-10s %s\n", cli_verbs[i]->name, cli_verbs[i]->about);
    fputs("\n  tetralod help VERB    what a verb takes, with examples\n"
          "  tetralod help scene   what a scene is made of, and its commands\n"
          "  tetralod --version    version of the program and its library\n\n",
          out);
    print_wrapped(out, RULES, 0, 0);
}

void cli_help_verb(FILE *out, const cli_verb *verb)
{
    fprintf(out, "tetralod %s: %s\n\nUsage: tetralod %s %s [options]\n", verb->name, verb->about,
            verb->name, verb->operands);
    if (verb->details) {
        fputc('\n', out);
        print_wrapped(out, verb->details, 0, 0);
    }
    if (verb->word) fputc('\n', out);
    for (size_t i = 0; verb->word && verb->word(i); i++)
        print_titled(out, verb->word(i), verb->word_about(verb->word(i)));
    for (size_t g = 0; g < CLI_GROUPS_MAX && verb->groups[g]; g++) {
        fprintf(out, "\n%s\n", verb->groups[g]->title);
        for (size_t i = 0; i < verb->groups[g]->option_count; i++)
            print_option(out, &verb->groups[g]->options[i]);
    }
    fputs("\nExamples\n", out);
    for (const char *const *example = verb->examples; *example; example += 2)
        fprintf(out, "  %s\n      %s\n", example[0], example[1]);
}

/* Table cells must not hold a bare '|'. */
static void print_cell(FILE *out, const char *text)
{
    for (; *text; text++) {
        if (*text == '|') fputc('\\', out);
        fputc(*text, out);
    }
}

static void markdown_verb(FILE *out, const cli_verb *verb)
{
    fprintf(out, "\n## tetralod %s\n\n%c%s.\n\n    tetralod %s %s [options]\n", verb->name,
            toupper((unsigned char)verb->about[0]), verb->about + 1, verb->name, verb->operands);
    if (verb->details) fprintf(out, "\n%s\n", verb->details);
    if (verb->word) fputc('\n', out);
    for (size_t i = 0; verb->word && verb->word(i); i++)
        fprintf(out, "- `%s`: %s\n", verb->word(i), verb->word_about(verb->word(i)));
    for (size_t g = 0; g < CLI_GROUPS_MAX && verb->groups[g]; g++) {
        const cli_group *group = verb->groups[g];
        fprintf(out, "\n| %s | |\n| --- | --- |\n", group->title);
        for (size_t i = 0; i < group->option_count; i++) {
            char title[96], text[1024];
            option_title(&group->options[i], title, sizeof title);
            option_text(&group->options[i], text, sizeof text);
            fputs("| `", out);
            print_cell(out, title);
            fputs("` | ", out);
            print_cell(out, text);
            fputs(" |\n", out);
        }
    }
    for (const char *const *example = verb->examples; *example; example += 2)
        fprintf(out, "\n%s:\n\n    %s\n", example[1], example[0]);
}

void cli_help_markdown(FILE *out)
{
    fprintf(out,
            "# The program tetralod\n\n%s\n\n%s\n\nThis page is the output of "
            "`tetralod help --markdown`; a test compares them.\n\n",
            ABOUT, RULES);
    fputs("| verb | job |\n| --- | --- |\n", out);
    for (size_t i = 0; cli_verbs[i]; i++)
        fprintf(out, "| [%s](#tetralod-%s) | %s |\n", cli_verbs[i]->name, cli_verbs[i]->name,
                cli_verbs[i]->about);
    for (size_t i = 0; cli_verbs[i]; i++) markdown_verb(out, cli_verbs[i]);
}
