/* Encodes a stream of one point whose ambient occlusion changes, and decodes it again in pieces as they
 * would come from a socket, one of them damaged on the way. */
#include <stdio.h>
#include <string.h>

#include "dapple.h"

static unsigned char stream[4096];
static size_t stream_size;

static int check(int status, const char *what) {
    if (status < 0) {
        fprintf(stderr, "%s: error %d\n", what, -status);
    }
    return status;
}

/* Takes what the encoder wrote: a server sends it. */
static void take(dapple_encoder *encoder) {
    const unsigned char *bytes;
    size_t size;
    dapple_encoder_bytes(encoder, &bytes, &size);
    memcpy(stream + stream_size, bytes, size);
    stream_size += size;
    dapple_encoder_clear(encoder);
}

static int encode(void) {
    dapple_grid grid = {
        .grid_from_mesh = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0},
        .dims = {4, 4, 4},
        .cell_edge = 0.5f,
        .radius = 0.25f,
        .position_bits = 5,
        .normal_bits = 4,
        .ao_bits = 8,
        .bucket_count = 7,
        .cell_capacity = 8,
    };
    dapple_track track = {
        .id = 1,
        .model = DAPPLE_MODEL_POINTS,
        .aabb_max = {2, 2, 2},
        .parameters = {.points = grid},
        .path = "hall/floor",
        .path_size = 10,
    };
    int status;
    dapple_encoder *encoder = dapple_encoder_new(NULL, &status);
    if (check(status, "new") < 0) {
        return 1;
    }
    const float middle[3] = {0.5f, 0.5f, 0.5f}, up[3] = {0, 1, 0};
    unsigned key = dapple_points_key(&grid, 1, 2, 3), cell_index = 0;
    unsigned bucket_index = dapple_points_bucket(&grid, key);
    uint32_t bucket[8] = {0}, cell[8] = {key};
    memset(bucket + 1, 0xff, sizeof bucket - sizeof *bucket);
    dapple_points_update update = {
        .track = 1,
        .bucket_indices = &bucket_index,
        .buckets = bucket,
        .bucket_count = 1,
        .cell_indices = &cell_index,
        .cells = cell,
        .cell_count = 1,
    };
    int failed = check(dapple_encoder_tracks(encoder, &track, 1), "tracks") < 0;
    for (unsigned frame = 0; frame < 8 && !failed; frame++) {
        cell[1] = dapple_points_pack(&grid, middle, up, (float)frame / 7);
        /* A group every fourth frame, so that a client can join there. */
        unsigned coverage = frame % 4 ? DAPPLE_COVERAGE_DELTA : DAPPLE_COVERAGE_KEYFRAME;
        if (coverage == DAPPLE_COVERAGE_KEYFRAME) {
            failed |= check(dapple_encoder_group(encoder, NULL), "group") < 0;
        }
        update.bucket_count = coverage == DAPPLE_COVERAGE_KEYFRAME;
        int points = dapple_encoder_points(encoder, coverage, &update, 1, DAPPLE_COMPRESSION_LZ4);
        failed |= check(points, "points") < 0;
        failed |= check(dapple_encoder_commit(encoder, frame), "commit") < 0;
        take(encoder);
    }
    failed |= check(dapple_encoder_end(encoder), "end") < 0;
    take(encoder);
    dapple_encoder_free(encoder);
    return failed;
}

int main(void) {
    if (encode()) {
        return 1;
    }
    stream[stream_size / 2] ^= 1;
    dapple_decoder *decoder = dapple_decoder_new(NULL);
    int frames = 0, errors = 0;
    for (size_t at = 0; at < stream_size;) {
        size_t piece = stream_size - at < 100 ? stream_size - at : 100, used;
        int status = dapple_decoder_push(decoder, stream + at, piece, &used, NULL);
        at += used;
        if (status < 0) {
            /* The last frame stays, and the next group is decoded. A real client has to reconnect if this
             * is not possible. */
            char sentence[256];
            dapple_decoder_error_message(decoder, sentence, sizeof sentence);
            printf("%s\n", sentence);
            errors++;
            if (!dapple_decoder_resume(decoder)) {
                break;
            }
        }
        frames += status == DAPPLE_EVENT_FRAME;
    }
    printf("%zu bytes, %d frames of 8, %d error\n", stream_size, frames, errors);
    dapple_decoder_free(decoder);
    return errors == 1 ? 0 : 1;
}
