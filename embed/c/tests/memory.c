/* Memory that cannot be had is an error, and none is lost: a stream is decoded with an allocator of its own
 * that fails at the first, second, third... allocation, and counts. */
#define _ISOC11_SOURCE
#include <stdio.h>
#include <stdlib.h>

#include "dapple.h"

static long left = -1; /* allocations before one fails; -1 for no failure */
static long blocks, bytes, most;

static void *allocate(size_t size, size_t alignment) {
    if (left == 0) {
        return NULL;
    }
    left -= left > 0;
    void *memory = aligned_alloc(alignment, (size + alignment - 1) / alignment * alignment);
    blocks += memory != NULL;
    bytes += (long)size;
    most = bytes > most ? bytes : most;
    return memory;
}

static void deallocate(void *memory, size_t size, size_t alignment) {
    (void)alignment;
    blocks--;
    bytes -= (long)size;
    free(memory);
}

static int decode(const unsigned char *stream, size_t size) {
    dapple_decoder *decoder = dapple_decoder_new(NULL);
    if (!decoder) {
        return -4013;
    }
    int status = 0;
    for (size_t at = 0, used; at < size && status >= 0; at += used) {
        size_t piece = size - at < 7 ? size - at : 7;
        status = dapple_decoder_push(decoder, stream + at, piece, &used, NULL);
        if (status == DAPPLE_EVENT_FRAME) {
            const dapple_dirty_range *ranges;
            size_t count;
            int dirty = dapple_decoder_dirty(decoder, &ranges, &count);
            status = dirty < 0 ? dirty : status;
        }
    }
    if (status >= 0) {
        status = dapple_decoder_finish(decoder);
    }
    dapple_decoder_free(decoder);
    return status;
}

int main(int count, char **words) {
    if (dapple_set_allocator(NULL, NULL) != -DAPPLE_ERROR_ARGUMENT ||
        dapple_set_allocator(allocate, deallocate) != 0) {
        fprintf(stderr, "the allocator is refused\n");
        return 1;
    }
    for (int i = 1; i < count; i++) {
        static unsigned char stream[65536];
        FILE *file = fopen(words[i], "rb");
        size_t size = file ? fread(stream, 1, sizeof stream, file) : 0;
        if (!file || fclose(file) != 0) {
            fprintf(stderr, "%s cannot be read\n", words[i]);
            return 1;
        }
        long failures = 0;
        for (int status = -4013; status == -4013; failures++) {
            left = failures;
            status = decode(stream, size);
            left = -1;
            if ((status != -4013 && status != 0) || blocks != 0 || bytes != 0) {
                fprintf(stderr, "%s: status %d after %ld allocations, %ld blocks and %ld bytes left\n",
                        words[i], status, failures, blocks, bytes);
                return 1;
            }
        }
        printf("%s: an error at each of %ld allocations, at most %ld bytes\n", words[i], failures - 1, most);
        if (failures < 5 || (unsigned long long)most > dapple_limits_heap_bytes(NULL)) {
            return 1;
        }
    }
    /* The allocator is settled. */
    return dapple_set_allocator(allocate, deallocate) == -DAPPLE_ERROR_ARGUMENT ? 0 : 1;
}
