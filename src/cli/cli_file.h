/* Small files of text, which appear under their name only when complete. */
#ifndef TETRALOD_CLI_FILE_H
#define TETRALOD_CLI_FILE_H

#include <stdio.h>

/* Opens a file beside path, or path itself if it is a device. Returns an exit status; the message
 * is out already, and *file NULL. */
int cli_file_begin(const char *path, FILE **file);
/* Closes it and gives it its name, or removes it if failed is an exit status of failure, which is
 * then returned. */
int cli_file_end(const char *path, FILE *file, int failed);

#endif
