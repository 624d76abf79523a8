/* Mappings of working files in the place of memory. All of them hang in a list, so that their pages
 * can be given back to the system now and then: a page that is touched again comes from the file.
 */
#define _GNU_SOURCE 1 /* madvise, posix_fallocate with large files */

#include "base/base_spill.h"
#include "base/base_context.h"
#include "base/base_scratch.h"

#include <errno.h>
#include <fcntl.h>
#include <stdalign.h>
#include <sys/mman.h>

/* Bytes that may be asked for, or seconds that may pass, until pages are given back. */
#define RELAX_BYTES ((uint64_t)32 << 20)
#define RELAX_S 0.02

/* Stands before the bytes of the caller. */
struct tli_spilled {
    alignas(16) tli_spilled *next;
    tli_spilled *previous;
    size_t bytes; /* of the mapping */
};

void tli_spill_begin(tl_ctx *ctx, const char *folder)
{
    tl_ctx *root = ctx->root;
    if (atomic_load(&root->budget_bytes))
        root->spill_folder = folder && folder[0] ? folder : "/tmp";
}

void tli_spill_end(tl_ctx *ctx)
{
    ctx->root->spill_folder = NULL;
}

uint64_t tli_spill_bytes(const tl_ctx *ctx)
{
    return atomic_load(&ctx->root->spilled_bytes);
}

static void hang(tl_ctx *root, tli_spilled *s)
{
    pthread_mutex_lock(&root->spill_mutex);
    s->next = root->spilled;
    s->previous = NULL;
    if (s->next) s->next->previous = s;
    root->spilled = s;
    pthread_mutex_unlock(&root->spill_mutex);
    atomic_fetch_add(&root->spilled_bytes, s->bytes);
}

void *tli_spill_map(tl_ctx *ctx, size_t byte_count)
{
    tl_ctx *root = ctx->root;
    tli_scratch *file = NULL;
    void *map = MAP_FAILED;
    size_t bytes = byte_count + sizeof(tli_spilled);
    if (bytes < byte_count || tli_scratch_open(ctx, root->spill_folder, &file)) return NULL;
    int error = tli_scratch_reserve(file, bytes, &map);
    tli_scratch_close(file);
    if (error) {
        tli_fail_system(ctx, TL_ERR_IO, error, "'%s': a working file of %zu bytes can't be made",
                        root->spill_folder, bytes);
        return NULL;
    }
    tli_spilled *s = map;
    s->bytes = bytes;
    hang(root, s);
    tli_spill_relax(ctx, byte_count);
    return s + 1;
}

size_t tli_spill_room(const void *block)
{
    const tli_spilled *s = (const tli_spilled *)block - 1;
    return s->bytes - sizeof *s;
}

void tli_spill_unmap(tl_ctx *ctx, void *block)
{
    tl_ctx *root = ctx->root;
    tli_spilled *s = (tli_spilled *)block - 1;
    pthread_mutex_lock(&root->spill_mutex);
    if (s->next) s->next->previous = s->previous;
    if (s->previous) s->previous->next = s->next;
    if (root->spilled == s) root->spilled = s->next;
    pthread_mutex_unlock(&root->spill_mutex);
    atomic_fetch_sub(&root->spilled_bytes, s->bytes);
    munmap(s, s->bytes);
}

void tli_spill_relax(tl_ctx *ctx, size_t more)
{
    tl_ctx *root = ctx->root;
    if (!atomic_load(&root->spilled_bytes)) return;
    double now = tli_clock_s();
    pthread_mutex_lock(&root->spill_mutex);
    root->spill_asked += more;
    if (root->spill_asked >= RELAX_BYTES || now - root->spill_relaxed >= RELAX_S) {
        root->spill_asked = 0;
        for (tli_spilled *s = root->spilled, *next; s; s = next) {
            next = s->next; /* of a page that comes back at once */
            (void)madvise(s, s->bytes, MADV_DONTNEED);
        }
        root->spill_relaxed = tli_clock_s();
    }
    pthread_mutex_unlock(&root->spill_mutex);
}
