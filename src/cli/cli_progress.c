/* One line on stderr while a long call runs: stage, bar, share, throughput, time left. It is drawn
 * only on a terminal and at most ten times a second. */
#include "cli_progress.h"

#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

#include "cli_print.h"

/* Seconds between two drawings, and before the first: what is done sooner needs no bar. */
#define REDRAW_S 0.1
#define PATIENCE_S 0.3

static volatile sig_atomic_t interrupted;

static void on_signal(int number)
{
    (void)number;
    interrupted = 1;
}

void cli_interrupt_install(void)
{
    struct sigaction action;
    memset(&action, 0, sizeof action);
    action.sa_handler = on_signal;
    action.sa_flags = (int)SA_RESETHAND; /* the second one meets the default: the end */
    sigemptyset(&action.sa_mask);
    sigaction(SIGINT, &action, NULL);
    sigaction(SIGTERM, &action, NULL);
    signal(SIGXFSZ, SIG_IGN); /* a file that may not grow is an error of writing, with a message */
}

bool cli_interrupted(void)
{
    return interrupted != 0;
}

static double read_clock(clockid_t id)
{
    struct timespec now;
    clock_gettime(id, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

double cli_now(void)
{
    return read_clock(CLOCK_MONOTONIC);
}

double cli_cpu(void)
{
    return read_clock(CLOCK_PROCESS_CPUTIME_ID);
}

static void draw(cli_progress *progress, double now, uint64_t done, uint64_t total)
{
    enum { BAR = 24 };
    char bar[BAR + 1];
    double share = total ? (double)done / (double)total : 0;
    double elapsed = now - progress->started;
    int filled = (int)(share * BAR);
    memset(bar, '.', BAR);
    memset(bar, '#', (size_t)filled);
    bar[BAR] = '\0';
    fprintf(stderr, "\r\033[K%-12.20s [%s] %3d %%", progress->stage, bar, (int)(100 * share));
    if (done > 0 && elapsed > 0) {
        fprintf(stderr, "  %s", cli_rate((double)done / elapsed).s);
        if (share > 0.01)
            fprintf(stderr, "  %s left", cli_seconds(elapsed * (1 - share) / share).s);
    }
    fflush(stderr);
    progress->drawn = true;
    progress->drawn_last = now;
}

bool cli_progress_step(cli_progress *progress, const char *stage, uint64_t done, uint64_t total)
{
    if (progress->shown) {
        double now = cli_now();
        if (strncmp(progress->stage, stage, sizeof progress->stage - 1) != 0) {
            snprintf(progress->stage, sizeof progress->stage, "%s", stage);
            progress->started = now;
        }
        if (now - progress->started >= PATIENCE_S && now - progress->drawn_last >= REDRAW_S)
            draw(progress, now, done > total ? total : done, total);
    }
    return !interrupted;
}

void cli_progress_clear(cli_progress *progress)
{
    if (progress->drawn) {
        fputs("\r\033[K", stderr);
        fflush(stderr);
    }
    progress->drawn = false;
    progress->stage[0] = '\0';
}
