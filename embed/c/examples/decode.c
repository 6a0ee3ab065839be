/* Decodes a file and prints what changed with each frame: what an engine uploads.
 *
 *   cc decode.c $(pkg-config --cflags --libs dapple) -o decode && ./decode stream.dapple
 */
#include <inttypes.h>
#include <stdio.h>

#include "dapple.h"

static int fail(dapple_decoder *decoder) {
    char sentence[256];
    dapple_decoder_error_message(decoder, sentence, sizeof sentence);
    fprintf(stderr, "%s\n", sentence);
    dapple_decoder_free(decoder);
    return 1;
}

/* A renderer copies bytes `start` to `end` of each array to its buffer of the same size. */
static void upload(dapple_decoder *decoder) {
    const dapple_dirty_range *dirty;
    size_t count;
    dapple_decoder_dirty(decoder, &dirty, &count);
    for (size_t i = 0; i < count; i++) {
        dapple_array array;
        dapple_decoder_array(decoder, dirty[i].buffer, dirty[i].track, &array);
        printf("  buffer %" PRIu32 " of track %" PRIu32 ": bytes %zu to %zu of %zu\n", dirty[i].buffer,
               dirty[i].track, array.element_size * dirty[i].start, array.element_size * dirty[i].end,
               array.size);
    }
    dapple_decoder_clear_dirty(decoder);
}

int main(int count, char **words) {
    if (count != 2) {
        fprintf(stderr, "usage: decode FILE\n");
        return 2;
    }
    FILE *file = fopen(words[1], "rb");
    if (!file) {
        perror(words[1]);
        return 1;
    }
    dapple_decoder *decoder = dapple_decoder_new(NULL);
    static unsigned char bytes[65536];
    for (size_t size; (size = fread(bytes, 1, sizeof bytes, file)) > 0;) {
        for (size_t at = 0, used; at < size; at += used) {
            dapple_event_info event;
            int status = dapple_decoder_push(decoder, bytes + at, size - at, &used, &event);
            if (status < 0) {
                fclose(file);
                return fail(decoder);
            }
            if (status == DAPPLE_EVENT_FRAME) {
                printf("frame %" PRIu32 " at tick %" PRIu64 "\n", event.frame.number, event.frame.tick);
                upload(decoder);
            }
        }
    }
    if (ferror(file)) {
        perror(words[1]);
    }
    fclose(file);
    if (dapple_decoder_finish(decoder) < 0) {
        return fail(decoder);
    }
    dapple_decoder_free(decoder);
    return 0;
}
