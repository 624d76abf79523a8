/* Whether a file is what it was: size, time of its last change, identity. */
#include "base/base_file.h"

#include <string.h>
#include <sys/stat.h>

tli_stamp tli_stamp_take(const char *path)
{
    struct stat info;
    tli_stamp stamp;
    memset(&stamp, 0, sizeof stamp);
    if (stat(path, &info) || !S_ISREG(info.st_mode)) return stamp;
    stamp.is_regular = true;
    stamp.bytes = (uint64_t)info.st_size;
    stamp.seconds = (int64_t)info.st_mtim.tv_sec;
    stamp.nanoseconds = (int64_t)info.st_mtim.tv_nsec;
    stamp.node = (uint64_t)info.st_ino;
    return stamp;
}

bool tli_stamp_holds(const char *path, const tli_stamp *before)
{
    if (!before->is_regular) return true;
    tli_stamp now = tli_stamp_take(path);
    return now.is_regular && now.bytes == before->bytes && now.seconds == before->seconds &&
           now.nanoseconds == before->nanoseconds && now.node == before->node;
}

tl_status tli_stamp_check(tl_ctx *ctx, const char *path, const tli_stamp *before, tl_status status)
{
    if (tli_stamp_holds(path, before)) return status;
    if (status) return tl_note(ctx, status, "'%s' changed while it was read", path);
    return tl_fail(ctx, TL_ERR_DATA, "'%s' changed while it was read", path);
}
