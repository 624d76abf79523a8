/* Files that are cut short, changed, or written by a forger who knows the checksum: an error that
 * names the file, or a result, but never a crash, and never a damaged file that passes the check.
 */
#include <unistd.h>

#include "store/store_format.h"
#include "tetralod/cut.h"

#include "make_store.h"

/* Where fields stand in the head and in an entry of the page directory; see docs/FORMAT.md. */
enum {
    OFS_VERSION = 8,
    OFS_FLAGS = 12,
    OFS_FILE_BYTES = 16,
    OFS_HEAD_BYTES = 24,
    OFS_IDENTITY = 32
};
enum { ENTRY_PAGE_OFS = 8, ENTRY_HASH = 16, ENTRY_PAGE_BYTES = 24 };

typedef struct small_file {
    tl_ctx *ctx;
    make_store model;
    uint8_t *bytes;
    size_t byte_count;
    bool draws;   /* also take meshes out of what opens */
    size_t drawn; /* meshes */
} small_file;

static void small_open(small_file *f)
{
    *f = (small_file){.draws = false};
    tl_ctx_opts opts = tl_ctx_opts_defaults();
    opts.thread_count = 1;
    opts.budget_bytes = (size_t)64 << 20;
    CHECK_STATUS(tl_ctx_create(&opts, &f->ctx), TL_OK);
    make_store_small(&f->model);
    CHECK_OK(f->ctx, make_store_write(f->ctx, f->ctx, &f->model, "small.tlod"));
    f->bytes = check_file_load("small.tlod", &f->byte_count);
}

static void small_close(small_file *f)
{
    free(f->bytes);
    CHECK_EQ(tl_ctx_current_bytes(f->ctx), 0);
    tl_ctx_destroy(f->ctx);
}

/* Draws what there is: whatever a forged index says, cuts end, and meshes are made or refused. */
static void draw(small_file *f, tl_store *store)
{
    tl_cut *cut = NULL;
    double bounds[TL_STORE_CHANNELS_MAX];
    const tl_store_head *head = tl_store_get_head(store);
    for (uint32_t c = 0; c < head->channel_count; c++) bounds[c] = 1e-3;
    if (tl_cut_create(f->ctx, store, &cut)) return;
    for (int i = 0; i < 4; i++) {
        tl_mesh *mesh = NULL;
        tl_cut_query query = tl_cut_query_defaults();
        if (i == 1) query.level = 0;
        if (i == 2) query.tets_max = 20;
        if (i == 3) query.bounds.channels = bounds;
        if (i == 3) query.bounds.space = 0.1;
        if (!tl_cut_update(cut, &query) && !tl_cut_mesh(cut, NULL, 0, &mesh)) {
            /* what the index says of patches was compared with what they decode to */
            CHECK_EQ(tl_cut_get_state(cut).tets, tl_mesh_tet_count(mesh));
            f->drawn++;
        }
        tl_mesh_destroy(mesh);
    }
    tl_cut_destroy(cut);
}

/* Opens a file of exactly these bytes, where a sanitizer sees a read past the end, and proves it.
 */
static tl_status prove(small_file *f, const uint8_t *bytes, size_t byte_count)
{
    tl_store *store = NULL;
    uint8_t *exact = malloc(byte_count ? byte_count : 1);
    CHECK(exact);
    if (byte_count) memcpy(exact, bytes, byte_count);
    tl_status st = tli_store_open_bytes(f->ctx, "small.tlod", exact, byte_count, &store);
    if (!st && f->draws) draw(f, store);
    if (!st) st = tl_store_check(f->ctx, store, TL_CHECK_FULL);
    if (st) CHECK(strstr(tl_ctx_message(f->ctx), "small.tlod"));
    tl_store_close(store);
    free(exact);
    return st;
}

static void check_refused(small_file *f, size_t byte_count, const char *what, size_t place)
{
    tl_status st = prove(f, f->bytes, byte_count);
    if (st != TL_ERR_FORMAT && st != TL_ERR_UNSUPPORTED)
        fail_msg("%s at %zu gave \"%s\"", what, place, tl_status_name(st));
}

/* ---- accidents ---- */

static void test_every_prefix(void **state)
{
    (void)state;
    small_file f;
    small_open(&f);
    CHECK_OK(f.ctx, prove(&f, f.bytes, f.byte_count));
    for (size_t length = 0; length < f.byte_count; length++)
        check_refused(&f, length, "a cut", length);
    small_close(&f);
}

static void test_every_byte(void **state)
{
    (void)state;
    const uint8_t changes[] = {0x01, 0x80, 0xff};
    small_file f;
    small_open(&f);
    printf("%zu bytes\n", f.byte_count);
    for (size_t i = 0; i < f.byte_count; i++)
        for (size_t k = 0; k < sizeof changes; k++) {
            f.bytes[i] ^= changes[k];
            check_refused(&f, f.byte_count, "a change", i);
            f.bytes[i] ^= changes[k];
        }
    small_close(&f);
}

static void test_bytes_behind_the_end(void **state)
{
    (void)state;
    small_file f;
    small_open(&f);
    f.bytes = realloc(f.bytes, f.byte_count + 16);
    CHECK(f.bytes);
    memset(f.bytes + f.byte_count, 0, 16);
    for (size_t more = 1; more <= 16; more++)
        check_refused(&f, f.byte_count + more, "an end", more);
    small_close(&f);
}

/* ---- forgers ---- */

static uint64_t get(const uint8_t *bytes, unsigned byte_count)
{
    return tli_take(&bytes, byte_count);
}

static void put(uint8_t *bytes, uint64_t value, unsigned byte_count)
{
    tli_put(&bytes, value, byte_count);
}

/* Makes the checksums of the head, of the page and of all blobs right where that is possible. */
static void forge(small_file *f)
{
    const uint64_t head_bytes = get(f->bytes + OFS_HEAD_BYTES, 8);
    const uint64_t identity = get(f->bytes + OFS_IDENTITY, 8);
    if (head_bytes > f->byte_count || head_bytes < TLI_HEAD_FIXED_BYTES + TLI_HEAD_PAGE_BYTES + 8)
        return;
    uint8_t *entry = f->bytes + head_bytes - TLI_STORE_HASH_BYTES - TLI_HEAD_PAGE_BYTES;
    const uint64_t page_ofs = get(entry + ENTRY_PAGE_OFS, 8),
                   page_bytes = get(entry + ENTRY_PAGE_BYTES, 4);
    if (page_ofs <= f->byte_count && page_bytes <= f->byte_count - page_ofs)
        put(entry + ENTRY_HASH,
            tli_store_hash(tli_store_seed(identity, TLI_PART_PAGE, 0, 0), f->bytes + page_ofs,
                           page_bytes),
            8);
    const size_t hashed = head_bytes - TLI_STORE_HASH_BYTES;
    put(f->bytes + hashed,
        tli_store_hash(tli_store_seed(identity, TLI_PART_HEAD, 0, 0), f->bytes, hashed), 8);
}

/* Every byte of head and page takes many values, with right checksums: whatever comes out, nothing
 * breaks. */
static void test_every_byte_forged(void **state)
{
    (void)state;
    const uint8_t values[] = {0x00, 0x01, 0x02, 0x7f, 0x80, 0xfe, 0xff};
    small_file f;
    small_open(&f);
    f.draws = true;
    uint8_t *good = malloc(f.byte_count);
    CHECK(good);
    memcpy(good, f.bytes, f.byte_count);
    const uint64_t head_bytes = get(f.bytes + OFS_HEAD_BYTES, 8);
    const uint64_t end =
        get(f.bytes + head_bytes - 8 - TLI_HEAD_PAGE_BYTES, 8); /* of the page, and padding */
    size_t passed = 0;
    for (size_t i = 0; i < end; i++)
        for (size_t k = 0; k < sizeof values; k++) {
            f.bytes[i] = values[k];
            forge(&f);
            passed += prove(&f, f.bytes, f.byte_count) == TL_OK;
            memcpy(f.bytes, good, f.byte_count);
        }
    CHECK(passed > 0); /* names, times, and the like may be anything */
    CHECK(f.drawn > passed);
    free(good);
    small_close(&f);
}

/* Random numbers over whole fields. */
static void test_random_forgeries(void **state)
{
    (void)state;
    small_file f;
    uint64_t seed = 3;
    small_open(&f);
    f.draws = true;
    uint8_t *good = malloc(f.byte_count);
    CHECK(good);
    memcpy(good, f.bytes, f.byte_count);
    const uint64_t head_bytes = get(f.bytes + OFS_HEAD_BYTES, 8);
    const uint64_t end = get(f.bytes + head_bytes - 8 - TLI_HEAD_PAGE_BYTES, 8);
    for (int i = 0; i < 30000; i++) {
        for (uint64_t fields = 1 + make_random(&seed) % 3; fields > 0; fields--) {
            const unsigned bytes = 1u << make_random(&seed) % 4;
            const uint64_t place = 16 + make_random(&seed) % (end - 24);
            const uint64_t shift = make_random(&seed) % 64;
            put(f.bytes + place, make_random(&seed) >> shift, bytes);
        }
        forge(&f);
        (void)prove(&f, f.bytes, f.byte_count);
        memcpy(f.bytes, good, f.byte_count);
    }
    free(good);
    small_close(&f);
}

/* ---- by name ---- */

static void check_message(small_file *f, tl_status expected, const char *words)
{
    CHECK_STATUS(prove(f, f->bytes, f->byte_count), expected);
    if (!strstr(tl_ctx_message(f->ctx), words))
        fail_msg("\"%s\" does not say \"%s\"", tl_ctx_message(f->ctx), words);
}

static void test_refused_by_name(void **state)
{
    (void)state;
    small_file f;
    small_open(&f);
    f.bytes[OFS_VERSION] = 2;
    forge(&f);
    check_message(&f, TL_ERR_UNSUPPORTED, "format version 2; this library reads version 1");
    f.bytes[OFS_VERSION] = 1;
    f.bytes[OFS_FLAGS] = 4;
    forge(&f);
    check_message(&f, TL_ERR_UNSUPPORTED, "flags 0x4");
    f.bytes[OFS_FLAGS] = 0;
    f.bytes[OFS_FILE_BYTES] ^= 8;
    forge(&f);
    check_message(&f, TL_ERR_FORMAT, "bytes where its head says");
    f.bytes[OFS_FILE_BYTES] ^= 8;
    f.bytes[OFS_IDENTITY] ^= 8;
    check_message(&f, TL_ERR_FORMAT, "the checksum of its head is wrong");
    f.bytes[OFS_IDENTITY] ^= 8;
    f.bytes[0] = 'P';
    check_message(&f, TL_ERR_FORMAT, "is no .tlod file");
    small_close(&f);
}

/* Places in the page of the small model: a segment, then its outputs, then patches. */
static uint8_t *page_of(small_file *f)
{
    return f->bytes + get(f->bytes + OFS_HEAD_BYTES, 8);
}

static uint8_t *patch_of(small_file *f, uint32_t id)
{
    const uint8_t *page = page_of(f);
    const uint64_t segment = TLI_SEGMENT_BYTES + TLI_SEGMENT_EACH_BYTES * f->model.channel_count;
    const uint64_t ofs = TLI_PAGE_HEAD_BYTES + segment * get(page, 4) +
                         TLI_OUTPUT_BYTES * get(page + 8, 4) + get(page + 12, 4);
    return page_of(f) + ofs +
           id * (uint64_t)(TLI_PATCH_BYTES + TLI_PATCH_EACH_BYTES * f->model.channel_count);
}

/* What a checksum can't see: graphs that lead back, errors that fall, sums that are wrong. */
static void test_broken_promises(void **state)
{
    (void)state;
    small_file f;
    small_open(&f);
    const uint64_t segment = TLI_PAGE_HEAD_BYTES;
    struct {
        uint64_t place; /* in the page */
        unsigned bytes;
        uint64_t value;
        tl_status status;
        const char *words;
    } cases[] = {
        {(uint64_t)(patch_of(&f, 2) - page_of(&f)), 4, 0, TL_ERR_FORMAT,
         "producer that is not finer"},
        {(uint64_t)(patch_of(&f, 0) - page_of(&f)), 4, 9, TL_ERR_FORMAT,
         "producer that is not finer"},
        {(uint64_t)(patch_of(&f, 0) - page_of(&f)), 4, TL_NONE, TL_ERR_DATA,
         "output with another producer"},
        {(uint64_t)(patch_of(&f, 2) - page_of(&f)) + 4, 4, 0xffffffff, TL_ERR_FORMAT,
         "blob that is too large"},
        {(uint64_t)(patch_of(&f, 2) - page_of(&f)) + 4, 4, 8, TL_ERR_FORMAT,
         "do not fill its part"},
        {(uint64_t)(patch_of(&f, 2) - page_of(&f)) + 16, 4, 0, TL_ERR_FORMAT,
         "too few or too many tets"},
        {(uint64_t)(patch_of(&f, 2) - page_of(&f)) + 23, 1, 1, TL_ERR_FORMAT, "another level"},
        {(uint64_t)(patch_of(&f, 2) - page_of(&f)) + 38, 2, 2, TL_ERR_FORMAT, "flags"},
        {(uint64_t)(patch_of(&f, 2) - page_of(&f)) + 36, 2, 1, TL_ERR_DATA,
         "outside of its sphere"},
        {(uint64_t)(patch_of(&f, 2) - page_of(&f)) + 46, 2, 1, TL_ERR_FORMAT, "range that is none"},
        {(uint64_t)(patch_of(&f, 2) - page_of(&f)) + 44, 2, get(patch_of(&f, 2) + 46, 2),
         TL_ERR_DATA, "is not in the range"},
        {(uint64_t)(patch_of(&f, 2) - page_of(&f)) + 8, 8, 3, TL_ERR_DATA, "all vertices"},
        {segment, 4, 5, TL_ERR_FORMAT, "inputs or outputs"},
        {segment + 4, 4, 3, TL_ERR_FORMAT, "inputs or outputs"},
        {segment + 8, 8, 1, TL_ERR_DATA, "another number of tets"},
        {segment + TLI_SEGMENT_BYTES + 4, 4, 2, TL_ERR_FORMAT, "output that is not coarser"},
        {segment + TLI_SEGMENT_BYTES + 8, 4, 0, TL_ERR_FORMAT, "not ascending"},
        {0, 4, 0, TL_ERR_FORMAT, "other counts than the page directory"},
        {12, 4, 7, TL_ERR_FORMAT, "counts that its bytes do not bear"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        uint8_t *place = page_of(&f) + cases[i].place;
        const uint64_t before = get(place, cases[i].bytes);
        put(place, cases[i].value, cases[i].bytes);
        forge(&f);
        check_message(&f, cases[i].status, cases[i].words);
        put(place, before, cases[i].bytes);
        forge(&f);
    }
    CHECK_OK(f.ctx, prove(&f, f.bytes, f.byte_count));
    small_close(&f);
}

/* An error that is smaller on the coarse side than on the fine one. */
static void test_unsaturated(void **state)
{
    (void)state;
    small_file f;
    small_open(&f);
    make_store m = {.level_count = 3, .coarse_segments = 1, .channel_count = 1, .vert_count = 5};
    make_store_open(&m);
    for (int kind = 0; kind < 5; kind++) {
        tli_store_writer *writer = NULL;
        tl_store *store = NULL;
        uint32_t patch = 0;
        CHECK_OK(f.ctx, tli_store_begin(f.ctx, "u.tlod", &m.head, m.codec, 0, &writer));
        for (uint32_t s = 0; s <= m.head.segment_count; s++) {
            make_store_segment made;
            uint32_t end = m.head.root_patch_count;
            if (s) make_store_get_segment(&m, s - 1, &made);
            if (s) end = made.info.first_patch + made.info.patch_count;
            for (; patch < end; patch++) {
                make_store_patch p;
                make_store_get_patch(f.ctx, &m, patch, &p);
                CHECK_OK(f.ctx, tli_store_add_patch(writer, &p.info,
                                                    (tli_blob){p.topology.bytes, p.topology.count},
                                                    p.blobs, NULL, 0));
                make_store_release_patch(f.ctx, &p);
            }
            if (!s) continue;
            if (s == 1 && kind == 1) made.max_error[0] = 0;
            if (s == 1 && kind == 2) made.info.boundary_error = 0;
            if (s == 1 && kind == 3) made.field_bins[20] = 0;
            if (s == 1 && kind == 4) made.space_bins[20] = 0;
            CHECK_OK(f.ctx, tli_store_add_segment(writer, &made.info));
        }
        CHECK_OK(f.ctx, tli_store_finish(writer, &m.head, true));
        CHECK_OK(f.ctx, tl_store_open(f.ctx, "u.tlod", &store));
        CHECK_STATUS(tl_store_check(f.ctx, store, TL_CHECK_FAST), kind ? TL_ERR_DATA : TL_OK);
        if (kind) CHECK(strstr(tl_ctx_message(f.ctx), "smaller error than its producer"));
        tl_store_close(store);
    }
    small_close(&f);
}

/* ---- while it is open ---- */

static void test_cut_short_while_open(void **state)
{
    (void)state;
    small_file f;
    tl_store *store = NULL;
    tl_patch_info info;
    small_open(&f);
    CHECK_OK(f.ctx, tl_store_open(f.ctx, "small.tlod", &store));
    CHECK_EQ(truncate("small.tlod", 100), 0);
    CHECK_STATUS(tl_store_patch(f.ctx, store, 0, &info), TL_ERR_IO);
    CHECK(strstr(tl_ctx_message(f.ctx), "more was expected"));
    tl_store_close(store);
    CHECK_STATUS(tl_store_open(f.ctx, "small.tlod", &store), TL_ERR_FORMAT);
    small_close(&f);
}

static void test_grown_or_changed_while_open(void **state)
{
    (void)state;
    small_file f;
    tl_store *store = NULL;
    small_open(&f);
    CHECK_OK(f.ctx, tl_store_open(f.ctx, "small.tlod", &store));
    CHECK_EQ(truncate("small.tlod", (off_t)f.byte_count + 1), 0);
    CHECK_STATUS(tl_store_check(f.ctx, store, TL_CHECK_FAST), TL_ERR_FORMAT);
    CHECK_EQ(truncate("small.tlod", (off_t)f.byte_count), 0);
    CHECK_OK(f.ctx, tl_store_check(f.ctx, store, TL_CHECK_FULL));
    FILE *file = fopen("small.tlod", "r+b");
    CHECK(file);
    CHECK_EQ(fseek(file, (long)f.byte_count - 20, SEEK_SET), 0);
    CHECK_EQ(fputc(0x5a ^ f.bytes[f.byte_count - 20], file), 0x5a ^ f.bytes[f.byte_count - 20]);
    fclose(file);
    CHECK_STATUS(tl_store_check(f.ctx, store, TL_CHECK_FULL), TL_ERR_FORMAT);
    tl_store_close(store);
    small_close(&f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_every_prefix),
        cmocka_unit_test(test_every_byte),
        cmocka_unit_test(test_bytes_behind_the_end),
        cmocka_unit_test(test_every_byte_forged),
        cmocka_unit_test(test_random_forgeries),
        cmocka_unit_test(test_refused_by_name),
        cmocka_unit_test(test_broken_promises),
        cmocka_unit_test(test_unsaturated),
        cmocka_unit_test(test_cut_short_while_open),
        cmocka_unit_test(test_grown_or_changed_while_open),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
