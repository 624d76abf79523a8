/* tetralod formats: what this build reads and writes. */
#include <string.h>

#include "cli_session.h"

static size_t format_count(void)
{
    size_t count = 0;
    while (tl_format_get(count)) count++;
    return count;
}

static void print_json(void)
{
    const tl_format *format;
    json_t *object = json_object();
    json_t *list = cli_json_list(object, "formats");
    for (size_t i = 0; (format = tl_format_get(i)); i++) {
        json_t *item = cli_json_item(list);
        cli_json_text(item, "name", format->name);
        cli_json_text(item, "about", format->about);
        cli_json_text(item, "endings", format->endings);
        cli_json_flag(item, "reads", format->reads);
        cli_json_flag(item, "writes", format->writes);
        cli_json_flag(item, "series", format->series);
        if (format->package) cli_json_text(item, "package", format->package);
    }
    cli_json_text(object, "version", cli_version().s);
    cli_json_print(object);
}

static tl_status print_text(tl_ctx *ctx)
{
    cli_table table;
    const tl_format *format;
    tl_status st = cli_table_create(ctx, format_count() + 1, 4, &table);
    if (st) return st;
    cli_table_head(&table, "format|reads|writes|series");
    for (size_t i = 0; (format = tl_format_get(i)); i++) {
        cli_table_set(&table, i + 1, 0, cli_name(format->name));
        cli_table_set(&table, i + 1, 1, cli_name(format->reads ? "yes" : "no"));
        cli_table_set(&table, i + 1, 2, cli_name(format->writes ? "yes" : "no"));
        cli_table_set(&table, i + 1, 3, cli_name(format->series ? "yes" : "no"));
    }
    cli_table_print(&table, 0);
    cli_table_destroy(&table);
    putchar('\n');
    for (size_t i = 0; (format = tl_format_get(i)); i++) {
        printf("%-18s  %s%s%s\n", format->name, format->about, *format->endings ? "; " : "",
               format->endings);
        if (format->package && !format->reads)
            printf("%-18s  not in this build: needs the Debian package %s\n", "", format->package);
    }
    return TL_OK;
}

static int run(cli_session *session)
{
    if (cli_get(session, CLI_JSON)->given) {
        print_json();
        return CLI_DONE;
    }
    tl_status st = print_text(session->ctx);
    return st ? cli_fail(session, session->ctx, st) : CLI_DONE;
}

static const cli_option OPTIONS[] = {
    {CLI_JSON, 0, "json", CLI_TYPE_FLAG, NULL, NULL, 0, 0, "print one JSON object on stdout"},
    {CLI_HELP, 'h', "help", CLI_TYPE_FLAG, NULL, NULL, 0, 0, "print this help"},
};
static const cli_group GROUP = {"Options", OPTIONS, sizeof OPTIONS / sizeof *OPTIONS};

static const char *const EXAMPLES[] = {"tetralod formats", "All formats, with their endings",
                                       "tetralod formats --json", "The same, for a script", NULL};

const cli_verb cli_verb_formats = {
    .name = "formats",
    .operands = "",
    .operand_least = 0,
    .operand_most = 0,
    .about = "list what this build reads and writes",
    .details = "Some formats need a library that was there when this program was built; those "
               "without it are listed with the name of the package. A series holds several steps.",
    .groups = {&GROUP},
    .examples = EXAMPLES,
    .run = run};
