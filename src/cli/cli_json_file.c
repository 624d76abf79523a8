/* JSON files, also as ParaView writes them: with commas before closing brackets. */
#include <errno.h>
#include <string.h>

#include "cli_file.h"
#include "cli_print.h"
#include "cli_session.h"

/* The most bytes of a file that make sense. */
#define FILE_BYTES_MOST ((size_t)64 << 20)

static int wrong(const char *path, const char *what)
{
    fprintf(stderr, "tetralod: '%s': %s\n", path, what);
    return CLI_FAILED;
}

/* Gives the text of a file (tl_mem_free). */
static int read_text(tl_ctx *ctx, const char *path, char **text, size_t *length)
{
    size_t room = 65536;
    tl_status st = TL_OK;
    int exit_status = CLI_DONE;
    FILE *file = fopen(path, "rb");
    *length = 0;
    *text = NULL;
    if (!file) return wrong(path, strerror(errno));
    do {
        room *= 2;
        if (room > FILE_BYTES_MOST) exit_status = wrong(path, "more than 64 MiB of JSON");
        if (!exit_status) *text = tl_mem_resize(ctx, *text, room, 1, &st);
        if (st) exit_status = wrong(path, tl_ctx_message(ctx));
        if (!exit_status) *length += fread(*text + *length, 1, room - *length, file);
    } while (!exit_status && *length == room);
    if (!exit_status && ferror(file)) exit_status = wrong(path, "it can't be read");
    fclose(file);
    return exit_status;
}

/* Makes a space of each comma that stands before a closing bracket. */
static void drop_trailing_commas(char *text, size_t length)
{
    bool in_text = false;
    size_t comma = SIZE_MAX;
    for (size_t i = 0; i < length; i++) {
        const char c = text[i];
        if (in_text && c == '\\')
            i++;
        else if (c == '"')
            in_text = !in_text;
        if (in_text || c == '"')
            comma = SIZE_MAX;
        else if (c == ',')
            comma = i;
        else if ((c == ']' || c == '}') && comma != SIZE_MAX)
            text[comma] = ' ';
        if (c != ',' && c != ' ' && c != '\t' && c != '\r' && c != '\n') comma = SIZE_MAX;
    }
}

int cli_json_read(tl_ctx *ctx, const char *path, bool commas, json_t **root)
{
    json_error_t error;
    char *text = NULL;
    size_t length = 0;
    *root = NULL;
    int exit_status = read_text(ctx, path, &text, &length);
    if (!exit_status) {
        if (commas) drop_trailing_commas(text, length);
        *root = json_loadb(text, length, 0, &error);
    }
    tl_mem_free(ctx, text);
    if (exit_status || *root) return exit_status;
    fprintf(stderr, "tetralod: can't read '%s' as JSON: line %d: %s\n", path, error.line,
            error.text);
    return CLI_FAILED;
}

int cli_json_write(json_t *root, const char *path)
{
    FILE *file;
    int failed = cli_file_begin(path, &file);
    if (!failed && json_dumpf(root, file, JSON_INDENT(1) | JSON_PRESERVE_ORDER))
        failed = wrong(path, "it can't be written");
    json_decref(root);
    return file ? cli_file_end(path, file, failed) : failed;
}
