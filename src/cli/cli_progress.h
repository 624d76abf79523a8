/* The progress bar and the wish of the user to stop. */
#ifndef TETRALOD_CLI_PROGRESS_H
#define TETRALOD_CLI_PROGRESS_H

#include <stdbool.h>
#include <stdint.h>

typedef struct cli_progress {
    bool shown;        /* there is a terminal and nobody asked for quiet */
    bool drawn;        /* a line is on the terminal */
    char stage[32];    /* the stage that is running */
    double started;    /* seconds, monotonic */
    double drawn_last; /* seconds, monotonic */
} cli_progress;

/* Seconds of a monotonic clock, and of all processors spent on the program. */
double cli_now(void);
double cli_cpu(void);

/* Ctrl-C and SIGTERM: the first sets the wish to stop, the second ends the program at once. */
void cli_interrupt_install(void);
bool cli_interrupted(void);

/* A tl_progress_fn over a cli_progress; false once the user wishes to stop. */
bool cli_progress_step(cli_progress *progress, const char *stage, uint64_t done, uint64_t total);
/* Takes the line off the terminal. */
void cli_progress_clear(cli_progress *progress);

#endif
