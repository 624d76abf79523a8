/* Objects for machines: jansson behind calls that can't produce JSON that is not valid. */
#include "cli_print.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

void cli_json_real(json_t *object, const char *key, double value)
{
    json_object_set_new(object, key, isfinite(value) ? json_real(value) : json_null());
}

void cli_json_count(json_t *object, const char *key, uint64_t value)
{
    json_object_set_new(object, key, json_integer((json_int_t)value));
}

void cli_json_flag(json_t *object, const char *key, bool value)
{
    json_object_set_new(object, key, json_boolean(value));
}

/* A JSON text of any bytes: as it is when it is UTF-8, else every byte as a Latin-1 letter. */
static json_t *text_value(const char *text)
{
    char letters[1024];
    size_t at = 0;
    json_t *value = json_string(text);
    if (value) return value;
    for (; *text && at + 2 < sizeof letters; text++) {
        unsigned char c = (unsigned char)*text;
        if (c >= 0x80) letters[at++] = (char)(0xc0 | c >> 6);
        letters[at++] = c >= 0x80 ? (char)(0x80 | (c & 0x3f)) : (char)c;
    }
    return json_stringn(letters, at);
}

void cli_json_text(json_t *object, const char *key, const char *text)
{
    json_object_set_new(object, key, text ? text_value(text) : json_null());
}

json_t *cli_json_list(json_t *object, const char *key)
{
    json_t *list = json_array();
    json_object_set_new(object, key, list);
    return list;
}

json_t *cli_json_object(json_t *object, const char *key)
{
    json_t *inner = json_object();
    json_object_set_new(object, key, inner);
    return inner;
}

json_t *cli_json_item(json_t *list)
{
    json_t *item = json_object();
    json_array_append_new(list, item);
    return item;
}

void cli_json_reals(json_t *object, const char *key, const double *values, size_t count)
{
    json_t *list = cli_json_list(object, key);
    for (size_t i = 0; i < count; i++)
        json_array_append_new(list, isfinite(values[i]) ? json_real(values[i]) : json_null());
}

void cli_json_counts(json_t *object, const char *key, const size_t *values, size_t count)
{
    json_t *list = cli_json_list(object, key);
    for (size_t i = 0; i < count; i++)
        json_array_append_new(list, json_integer((json_int_t)values[i]));
}

void cli_json_print(json_t *object)
{
    json_dumpf(object, stdout, JSON_INDENT(1) | JSON_PRESERVE_ORDER);
    putchar('\n');
    json_decref(object);
}
