/* Stage extract, internal: an expression as operations in the order in which a stack of values
 * takes them. extract_expression.c reads it, extract_evaluate.c computes it. */
#ifndef TETRALOD_SRC_EXTRACT_EXPRESSION_H
#define TETRALOD_SRC_EXTRACT_EXPRESSION_H

#include "extract/extract.h"

typedef enum tli_op_kind {
    TLI_OP_NUMBER,
    TLI_OP_CHANNEL,
    TLI_OP_POSITION, /* index: axis */
    /* of one value, by component */
    TLI_OP_NEGATE,
    TLI_OP_NOT,
    TLI_OP_ABS,
    TLI_OP_SQRT,
    TLI_OP_EXP,
    TLI_OP_LOG,
    TLI_OP_LOG10,
    TLI_OP_SIN,
    TLI_OP_COS,
    TLI_OP_TAN,
    /* of two values, by component */
    TLI_OP_ADD,
    TLI_OP_SUBTRACT,
    TLI_OP_MULTIPLY,
    TLI_OP_DIVIDE,
    TLI_OP_POWER,
    TLI_OP_ATAN2,
    TLI_OP_MIN,
    TLI_OP_MAX,
    TLI_OP_LESS,
    TLI_OP_LESS_EQUAL,
    TLI_OP_GREATER,
    TLI_OP_GREATER_EQUAL,
    TLI_OP_EQUAL,
    TLI_OP_NOT_EQUAL,
    TLI_OP_AND,
    TLI_OP_OR,
    /* the others */
    TLI_OP_IF,
    TLI_OP_VECTOR, /* index: of so many scalars */
    TLI_OP_PICK,   /* index: component */
    TLI_OP_MAGNITUDE,
    TLI_OP_NORMALIZE,
    TLI_OP_DOT,
    TLI_OP_CROSS,
    TLI_OP_DERIVE /* index: tl_derived, of all of the value's elements */
} tli_op_kind;

typedef struct tli_op {
    tli_op_kind kind;
    uint32_t column; /* in the text, from 1, in characters */
    double number;
    size_t index;
    char *name; /* of a channel; owned */
} tli_op;

struct tl_expression {
    char *text;
    tli_op *ops;
    size_t op_count;
};

/* Fails with the column and the text of an expression in front. */
tl_status tli_expression_fail(tl_ctx *ctx, const tl_expression *expression, size_t column,
                              const char *format, ...) TL_PRINTF(4, 5);

#endif
