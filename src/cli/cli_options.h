/* The command line as tables. A verb is a list of option groups; the same rows are parsed, printed
 * as help and written as docs/CLI.md, so that text, defaults and behaviour can't drift apart. */
#ifndef TETRALOD_CLI_OPTIONS_H
#define TETRALOD_CLI_OPTIONS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include "tetralod/base.h"

/* Exit statuses of the program. */
#define CLI_DONE 0
#define CLI_FAILED 1
#define CLI_WRONG_USE 2

/* Values that one repeatable option can collect. */
#define CLI_LIST_MAX 64
#define CLI_OPERANDS_MAX 1024
#define CLI_GROUPS_MAX 8
/* Longest name of a channel on the command line, its end included. */
#define CLI_NAME_BYTES 512

typedef enum cli_id {
    CLI_OUTPUT,
    CLI_RATIO,
    CLI_TETS,
    CLI_ERROR,
    CLI_BOUNDARY_ERROR,
    CLI_METHOD,
    CLI_PLACEMENT,
    CLI_CHANNELS,
    CLI_MIN_QUALITY,
    CLI_SEED,
    CLI_LEVEL,
    CLI_FULL,
    CLI_BOX,
    CLI_OUTSIDE_ERROR,
    CLI_VIEW,
    CLI_PIXELS,
    CLI_VALUE,
    CLI_PICTURE_SIZE,
    CLI_SAMPLES,
    CLI_BACKGROUND,
    CLI_CAMERA,
    CLI_VOLUME,
    CLI_COLORMAP,
    CLI_RANGE,
    CLI_CENTER,
    CLI_AT,
    CLI_ALONG,
    CLI_INTEGRAL,
    CLI_STATISTICS,
    CLI_ANNOTATION,
    CLI_TITLE,
    CLI_RENDERER,
    CLI_SCENE,
    CLI_WRITE_SCENE,
    CLI_VOLUME_METHOD,
    CLI_PARALLEL,
    CLI_WRITE_CAMERA,
    CLI_FRAMES,
    CLI_ORBIT,
    CLI_LIT,
    CLI_GRADIENT_OPACITY,
    CLI_SURFACE,
    CLI_SLICE,
    CLI_BOUNDARY,
    CLI_INTERFACES,
    CLI_EDGES,
    CLI_SILHOUETTES,
    CLI_POINTS,
    CLI_LINES,
    CLI_COLOR_PATCHES,
    CLI_COLOR_LEVELS,
    CLI_COLOR_BY,
    CLI_LOG,
    CLI_WRITE_TRANSFER,
    CLI_SEEDS,
    CLI_ORDER,
    CLI_STRIDE,
    CLI_TOLERANCE,
    CLI_DIRECTION,
    CLI_LENGTH,
    CLI_DURATION,
    CLI_STEPS_MAX,
    CLI_SLOWEST,
    CLI_PLANE,
    CLI_NO_NORMALS,
    CLI_BYTES,
    CLI_SPACE_ERROR,
    CLI_CLASSIFIED_ERROR,
    CLI_TRANSFER,
    CLI_ISO,
    CLI_SPACING,
    CLI_SKIP_BOUNDARY,
    CLI_SIZE,
    CLI_SIZES,
    CLI_DATA,
    CLI_SAMPLE,
    CLI_CHANNEL,
    CLI_KEEP,
    CLI_RUNS,
    CLI_SECONDS,
    CLI_THROTTLE,
    CLI_AGAINST_VTK,
    CLI_VTK_SCALE,
    CLI_SCRIPT,
    CLI_SCREENSHOT,
    CLI_STATS,
    CLI_SOLUTION,
    CLI_RAW,
    CLI_SPLIT,
    CLI_CELL_TO_POINT,
    CLI_FILL_VALUE,
    CLI_KEEP_FILL,
    CLI_AGAINST,
    CLI_CUTS,
    CLI_MESHES,
    CLI_CHANNEL_ERROR,
    CLI_POSITION_ERROR,
    CLI_LOSSLESS,
    CLI_RAW_LAYOUT,
    CLI_SEGMENT_TETS,
    CLI_PATCH_TETS,
    CLI_PARTITION,
    CLI_PRUNE,
    CLI_REDUCTION,
    CLI_TMP,
    CLI_KEEP_WORK,
    CLI_RESUME,
    CLI_STOP_AFTER,
    CLI_STEPS,
    CLI_STEER,
    CLI_ADD_CHANNEL,
    CLI_AS_STEP,
    CLI_REGION,
    CLI_DETAILS,
    CLI_COUNT,
    CLI_VALUES,
    CLI_SHELLS,
    CLI_AREA,
    CLI_DERIVE,
    CLI_THRESHOLD,
    CLI_REGIONS,
    CLI_HIDE_REGIONS,
    CLI_CLIP,
    CLI_FAST,
    CLI_STEP,
    CLI_TIME,
    CLI_WELD,
    CLI_ZLIB,
    CLI_ASCII,
    CLI_THREADS,
    CLI_MEMORY,
    CLI_JSON,
    CLI_QUIET,
    CLI_HELP,
    CLI_ID_COUNT
} cli_id;

typedef enum cli_type {
    CLI_TYPE_FLAG,   /* takes no value */
    CLI_TYPE_COUNT,  /* whole number */
    CLI_TYPE_REAL,   /* number, NaN allowed where the range says so */
    CLI_TYPE_AMOUNT, /* number >= 0, or a percentage */
    CLI_TYPE_BYTES,  /* whole number with an optional K, M, G or T (powers of 1024) */
    CLI_TYPE_TEXT,
    CLI_TYPE_INPUT,  /* text: a file that is read, alone or behind CHANNEL: or CHANNEL= */
    CLI_TYPE_INPUTS, /* the same; may be given several times */
    CLI_TYPE_OUTPUT, /* text: a file that is written */
    CLI_TYPE_CHOICE, /* one of the words of meta, separated by | */
    CLI_TYPE_LIST    /* text; may be given several times */
} cli_type;

typedef struct cli_option {
    cli_id id;
    char letter;      /* 0: none */
    const char *name; /* without the dashes */
    cli_type type;
    const char *meta;    /* what stands for the value in help; of a choice its words */
    const char *initial; /* the default as the user would type it; NULL: none */
    double least, most;  /* range of a COUNT, REAL or AMOUNT; both 0: any; least DBL_MIN: above 0 */
    const char *help;    /* one sentence without the final stop */
} cli_option;

typedef struct cli_group {
    const char *title;
    const cli_option *options;
    size_t option_count;
} cli_group;

typedef struct cli_session cli_session;

typedef struct cli_verb {
    const char *name;
    const char *operands; /* as in the usage line */
    size_t operand_least, operand_most;
    size_t operand_output;                   /* number of the operand that is written; 0: none */
    bool may_replace;                        /* a mesh of a mesh: the output may be the operand */
    const char *about;                       /* one line */
    const char *details;                     /* a paragraph, may be NULL */
    const cli_group *groups[CLI_GROUPS_MAX]; /* NULL ends the list */
    const char *const *examples;             /* pairs of command and explanation; NULL ends it */
    int (*run)(cli_session *session);        /* returns an exit status */
    const char *(*word)(size_t index); /* words the first operand can be, NULL ends; may be NULL */
    const char *(*word_about)(const char *word);
} cli_verb;

typedef struct cli_value {
    bool given; /* by the user; false: the default */
    bool percent;
    double real; /* of an AMOUNT in percent: the fraction */
    uint64_t count;
    int choice; /* index of the word */
    const char *text;
    const char *items[CLI_LIST_MAX];
    size_t item_count;
} cli_value;

typedef struct cli_args {
    const cli_verb *verb;
    const char *operands[CLI_OPERANDS_MAX];
    size_t operand_count;
    cli_value values[CLI_ID_COUNT];
} cli_args;

/* The groups that several verbs share. */
extern const cli_group cli_group_reading;
extern const cli_group cli_group_writing;
extern const cli_group cli_group_common;

/* All verbs in the order of the help; NULL ends the list. */
extern const cli_verb *const cli_verbs[];

extern const cli_verb cli_verb_sample;
extern const cli_verb cli_verb_info;
extern const cli_verb cli_verb_convert;
extern const cli_verb cli_verb_simplify;
extern const cli_verb cli_verb_build;
extern const cli_verb cli_verb_compare;
extern const cli_verb cli_verb_extract;
extern const cli_verb cli_verb_surface;
extern const cli_verb cli_verb_points;
extern const cli_verb cli_verb_lines;
extern const cli_verb cli_verb_render;
extern const cli_verb cli_verb_view;
extern const cli_verb cli_verb_probe;
extern const cli_verb cli_verb_check;
extern const cli_verb cli_verb_bench;
extern const cli_verb cli_verb_formats;

/* argv [argc] are the words after the verb. Returns CLI_DONE or CLI_WRONG_USE, then the message is
 * out already. */
int cli_parse(const cli_verb *verb, int argc, char **argv, cli_args *args);

/* Refuses words that would write one file over another one that they name, or read. Returns an exit
 * status; the message is out already. cli_roles.c */
int cli_roles_check(const cli_args *args);

/* Reads "0.5", "0.5%"; false if text is not all of a finite number >= 0. */
bool cli_parse_amount(const char *text, double *value, bool *percent);
/* Reads all of text as a number (NaN and infinity too). */
bool cli_parse_real(const char *text, double *value);
/* Reads count finite numbers separated by commas; false if text is anything else. */
bool cli_parse_reals(const char *text, double *values, size_t count);
/* Reads "X0,Y0,Z0,X1,Y1,Z1", two corners in any order, as x0, x1, y0, y1, z0, z1, each pair rising;
 * false if text is anything else. */
bool cli_parse_box(const char *text, double bounds[6]);
/* Reads length bytes of text: "V", or "P%" of a range. False for what is no number, and for NaN. */
bool cli_parse_part(const char *text, size_t length, const double range[2], double *value);
/* True if the texts of a list, or the words between their commas, name it. */
bool cli_list_names(const cli_value *list, const char *name);
/* Looks for a word between the commas of a list that is not known, nor is its text as a whole; true
 * if there is one, which is then in name. */
bool cli_list_unknown(const cli_value *list, bool (*is_known)(const void *arg, const char *name),
                      const void *arg, char name[CLI_NAME_BYTES]);
/* Splits "NAME=VALUE" at its last '='; name receives the part before, false if there is none or it
 * does not fit. */
bool cli_split_named(const char *text, char *name, size_t name_bytes, const char **value);

/* Reads an error bound "[CHANNEL=]V[%]" above 0; name stays empty for all channels. */
bool cli_parse_bound(const char *text, char name[CLI_NAME_BYTES], double *value, bool *percent);

/* Says what is wrong and where the help is; returns CLI_WRONG_USE. verb may be NULL. */
int cli_misuse(const cli_verb *verb, const char *format, ...) TL_PRINTF(2, 3);

/* The word nearest to text among count words, NULL if none is near. */
const char *cli_nearest(const char *text, const char *const *words, size_t word_count);

/* Help. */
void cli_help_program(FILE *out);
void cli_help_verb(FILE *out, const cli_verb *verb);
void cli_help_markdown(FILE *out);
/* The table of scenes, docs/SCENE.md; cli_help_scene.c. */
void cli_help_scene(FILE *out);

#endif
