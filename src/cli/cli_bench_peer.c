/* Runs the script that measures VTK, as a process of its own, and reads what it prints. */
#include <errno.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#include "cli_bench.h"

/* Debian's interpreter: another python3 that comes first on the path would not see VTK. */
#define PYTHON "/usr/bin/python3"
#define SCRIPT "vtk_peer.py"
#define ARGS_MAX 24

/* --script, else beside an installed program, else in the source tree of this build. */
static void find_script(const bench_state *state, char *path, size_t path_bytes)
{
    const char *given = cli_get(state->session, CLI_SCRIPT)->text;
    char program[4000];
    ssize_t n = readlink("/proc/self/exe", program, sizeof program - 1);
    program[n > 0 ? n : 0] = '\0';
    for (int up = 0; up < 2; up++) {
        char *slash = strrchr(program, '/');
        if (slash) *slash = '\0';
    }
    snprintf(path, path_bytes, "%s/share/tetralod/" SCRIPT, program);
    if (given)
        snprintf(path, path_bytes, "%s", given);
    else if (access(path, R_OK) != 0)
        snprintf(path, path_bytes, "%s/" SCRIPT, TETRALOD_BENCH_FOLDER);
}

static void become_peer(int out, char *const *argv)
{
    dup2(out, STDOUT_FILENO);
    execv(argv[0], argv);
    _exit(127);
}

json_t *bench_peer(const bench_state *state, const char *const *args)
{
    char script[BENCH_PATH_BYTES + 64];
    const char *argv[ARGS_MAX + 3] = {PYTHON, script};
    int ends[2], wait_status = 0;
    json_error_t error = {0};
    find_script(state, script, sizeof script);
    for (size_t i = 0; i < ARGS_MAX && args[i]; i++) argv[i + 2] = args[i];
    fflush(stdout);
    if (pipe(ends)) {
        fprintf(stderr, "tetralod: can't start the peer: %s\n", strerror(errno));
        return NULL;
    }
    pid_t child = fork();
    if (child == 0) {
        close(ends[0]);
        become_peer(ends[1], (char *const *)(uintptr_t)argv); /* execv does not change the words */
    }
    close(ends[1]);
    FILE *from = fdopen(ends[0], "r");
    json_t *object = from ? json_loadf(from, 0, &error) : NULL;
    if (from) fclose(from);
    if (child > 0) waitpid(child, &wait_status, 0);
    if (child > 0 && WIFEXITED(wait_status) && WEXITSTATUS(wait_status) == 0 && object)
        return object;
    fprintf(stderr, "tetralod: the peer script '%s' failed (" PYTHON " with VTK is needed)\n",
            script);
    json_decref(object);
    return NULL;
}
