/* JSON text to jansson's values. */
#include "scene/scene_load_jansson.h"

#include <string.h>

/* The most bytes of memory that a byte of JSON becomes: an empty object, three bytes with its
 * comma, has a table. */
enum { TREE_BYTES = 80 };

/* Makes a space of each comma that stands before a closing bracket. */
static void drop_trailing_commas(char *text, size_t bytes)
{
    bool in_text = false;
    size_t comma = SIZE_MAX;
    for (size_t i = 0; i < bytes; i++) {
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

tl_status tli_json_load(tl_ctx *ctx, const char *name, char *text, size_t bytes, bool commas,
                        tli_json *json)
{
    json_error_t error;
    tl_status st = TL_OK;
    *json = (tli_json){0};
    if (bytes >= 2 && (memcmp(text, "\xff\xfe", 2) == 0 || memcmp(text, "\xfe\xff", 2) == 0))
        return tl_fail(ctx, TL_ERR_FORMAT, "'%s' is in UTF-16, expected JSON in UTF-8", name);
    if (bytes >= 3 && memcmp(text, "\xef\xbb\xbf", 3) == 0) memset(text, ' ', 3);
    *json = (tli_json){.reserve = tl_mem_alloc(ctx, bytes + 1, TREE_BYTES, &st)};
    if (st) return st;
    if (commas) drop_trailing_commas(text, bytes);
    json->root = json_loadb(text, bytes, commas ? 0 : JSON_REJECT_DUPLICATES, &error);
    if (json->root) return TL_OK;
    tli_json_unload(ctx, json);
    return tl_fail(ctx, TL_ERR_FORMAT, "can't read '%s' as JSON: line %d: %s", name, error.line,
                   error.text);
}

void tli_json_unload(tl_ctx *ctx, tli_json *json)
{
    json_decref(json->root);
    tl_mem_free(ctx, json->reserve);
    *json = (tli_json){0};
}
