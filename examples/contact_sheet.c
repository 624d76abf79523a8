/* Puts pictures of one size side by side: contact_sheet OUT.png COLUMNS PICTURE.png ... */
#include <png.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* White around each picture, pixels. */
enum { MARGIN = 4, CHANNELS = 3 };

static int fail(const char *path, const png_image *picture)
{
    fprintf(stderr, "contact_sheet: %s: %s\n", path, picture->message);
    return 1;
}

/* Reads a picture into its place on the sheet. */
static int place(const char *path, png_bytep sheet, png_uint_32 width, png_uint_32 height,
                 size_t row_bytes)
{
    png_image picture = {.version = PNG_IMAGE_VERSION};
    if (!png_image_begin_read_from_file(&picture, path)) return fail(path, &picture);
    if (picture.width != width || picture.height != height) {
        png_image_free(&picture);
        fprintf(stderr, "contact_sheet: %s: not as large as the first picture\n", path);
        return 1;
    }
    picture.format = PNG_FORMAT_RGB;
    const png_color white = {255, 255, 255};
    return png_image_finish_read(&picture, &white, sheet, (png_int_32)row_bytes, NULL)
               ? 0
               : fail(path, &picture);
}

int main(int argc, char **argv)
{
    const int columns = argc > 3 ? atoi(argv[2]) : 0, count = argc - 3;
    png_image first = {.version = PNG_IMAGE_VERSION}, sheet = {.version = PNG_IMAGE_VERSION};
    if (columns < 1 || columns > 100) {
        fprintf(stderr, "usage: contact_sheet OUT.png COLUMNS PICTURE.png ...\n");
        return 2;
    }
    if (!png_image_begin_read_from_file(&first, argv[3])) return fail(argv[3], &first);
    const png_uint_32 width = first.width, height = first.height;
    const size_t rows = (size_t)((count + columns - 1) / columns);
    png_image_free(&first);
    sheet.width = (png_uint_32)columns * (width + MARGIN) + MARGIN;
    sheet.height = (png_uint_32)rows * (height + MARGIN) + MARGIN;
    sheet.format = PNG_FORMAT_RGB;
    const size_t row_bytes = (size_t)sheet.width * CHANNELS;
    png_bytep pixels = malloc(row_bytes * sheet.height);
    if (!pixels) return 1;
    memset(pixels, 255, row_bytes * sheet.height);
    int failed = 0;
    for (int i = 0; i < count && !failed; i++) {
        const size_t x = MARGIN + (size_t)(i % columns) * (width + MARGIN);
        const size_t y = MARGIN + (size_t)(i / columns) * (height + MARGIN);
        failed =
            place(argv[3 + i], pixels + y * row_bytes + x * CHANNELS, width, height, row_bytes);
    }
    if (!failed &&
        !png_image_write_to_file(&sheet, argv[1], 0, pixels, (png_int_32)row_bytes, NULL))
        failed = fail(argv[1], &sheet);
    free(pixels);
    return failed;
}
