/* A decoder as a program that speaks the protocol of conformance/README.md, in C11 on nothing but
 * dapple.h: canonical dumps of all models, sessions, limits, batch. Queries are not implemented, since a
 * sampler is no part of a decoder.
 *
 *   dapple conformance --decoder embed/c/build/conformance --batch
 */
#include <inttypes.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "dapple.h"

enum { COMPLETE = 0, REFUSED = 1, NEED_INPUT = 2, NOT_IMPLEMENTED = 89, NO_ANSWER = 70 };

static void quit(const char *why) {
    fprintf(stderr, "%s\n", why);
    exit(NO_ANSWER);
}

/* ---- Text that grows ---- */

typedef struct {
    char *bytes;
    size_t size, capacity;
} text;

static void append(text *out, const void *bytes, size_t size) {
    if (out->capacity - out->size < size + 1) {
        out->capacity = 2 * out->capacity + size + 64;
        out->bytes = realloc(out->bytes, out->capacity);
        if (!out->bytes) {
            quit("out of memory");
        }
    }
    memcpy(out->bytes + out->size, bytes, size);
    out->size += size;
}

static void print(text *out, const char *format, ...) {
    char line[128];
    va_list arguments;
    va_start(arguments, format);
    int size = vsnprintf(line, sizeof line, format, arguments);
    va_end(arguments);
    append(out, line, (size_t)size);
}

/* A float as its bits, after a space. */
static void print_floats(text *out, const float *values, size_t count) {
    for (size_t i = 0; i < count; i++) {
        uint32_t bits;
        memcpy(&bits, &values[i], 4);
        print(out, " %08" PRIx32, bits);
    }
}

static void print_quoted(text *out, const char *bytes, size_t size) {
    append(out, "\"", 1);
    for (size_t i = 0; i < size; i++) {
        unsigned char byte = (unsigned char)bytes[i];
        if (byte == '"' || byte == '\\') {
            print(out, "\\%c", byte);
        } else if (byte < 0x20 || byte == 0x7f) {
            print(out, "\\u%04x", byte);
        } else {
            append(out, &byte, 1);
        }
    }
    append(out, "\"", 1);
}

/* ---- XXH64 with seed 0 ---- */

#define P1 UINT64_C(11400714785074694791)
#define P2 UINT64_C(14029467366897019727)
#define P3 UINT64_C(1609587929392839161)
#define P4 UINT64_C(9650029242287828579)
#define P5 UINT64_C(2870177450012600261)

static uint64_t rotate(uint64_t value, int bits) { return value << bits | value >> (64 - bits); }

static uint64_t little(const unsigned char *bytes, int count) {
    uint64_t value = 0;
    for (int i = count - 1; i >= 0; i--) {
        value = value << 8 | bytes[i];
    }
    return value;
}

static uint64_t xxh_round(uint64_t lane, uint64_t word) { return rotate(lane + word * P2, 31) * P1; }

static uint64_t xxh64(const unsigned char *bytes, size_t size) {
    const unsigned char *at = bytes, *end = bytes + size;
    uint64_t hash = P5;
    if (size >= 32) {
        uint64_t lanes[4] = {P1 + P2, P2, 0, 0 - P1};
        for (; end - at >= 32; at += 32) {
            for (int i = 0; i < 4; i++) {
                lanes[i] = xxh_round(lanes[i], little(at + 8 * i, 8));
            }
        }
        hash = rotate(lanes[0], 1) + rotate(lanes[1], 7) + rotate(lanes[2], 12) + rotate(lanes[3], 18);
        for (int i = 0; i < 4; i++) {
            hash = (hash ^ xxh_round(0, lanes[i])) * P1 + P4;
        }
    }
    hash += size;
    for (; end - at >= 8; at += 8) {
        hash = rotate(hash ^ xxh_round(0, little(at, 8)), 27) * P1 + P4;
    }
    if (end - at >= 4) {
        hash = rotate(hash ^ little(at, 4) * P1, 23) * P2 + P3;
        at += 4;
    }
    for (; at < end; at++) {
        hash = rotate(hash ^ *at * P5, 11) * P1;
    }
    hash = (hash ^ hash >> 33) * P2;
    hash = (hash ^ hash >> 29) * P3;
    return hash ^ hash >> 32;
}

/* ---- The dump (spec/dump.md) ---- */

static dapple_array array_of(dapple_decoder *decoder, uint32_t buffer, uint32_t track) {
    dapple_array array;
    if (dapple_decoder_array(decoder, buffer, track, &array) < 0) {
        quit("an array of a track that there is");
    }
    return array;
}

static void dump_grid(const dapple_track *track, text *out) {
    const dapple_grid *grid = &track->parameters.points;
    print(out, "grid %" PRIu32 " %" PRIu32 " %" PRIu32 " %" PRIu32, track->id, grid->dims[0],
          grid->dims[1], grid->dims[2]);
    print(out, " %" PRIu32 " %" PRIu32 " %" PRIu32 ",%" PRIu32 ",%" PRIu32, grid->bucket_count,
          grid->cell_capacity, grid->position_bits, grid->normal_bits, grid->ao_bits);
    print_floats(out, &grid->cell_edge, 1);
    print_floats(out, &grid->radius, 1);
    print_floats(out, grid->grid_from_mesh, 12);
}

static void dump_buckets(dapple_decoder *decoder, const dapple_track *track, text *out) {
    const dapple_grid *grid = &track->parameters.points;
    int digits = (int)(1 + 3 * grid->position_bits + 2 * grid->normal_bits + grid->ao_bits) / 4;
    const uint32_t *buckets = array_of(decoder, DAPPLE_BUFFER_POINTS_BUCKETS, track->id).data;
    const uint32_t *cells = array_of(decoder, DAPPLE_BUFFER_POINTS_CELLS, track->id).data;
    buckets += 8 * (size_t)grid->first_bucket;
    cells += 8 * (size_t)grid->first_cell;
    for (uint32_t index = 0; index < grid->bucket_count; index++) {
        const uint32_t *bucket = buckets + 8 * (size_t)index;
        if (bucket[0] == UINT32_MAX) {
            continue;
        }
        print(out, "bucket %" PRIu32 " %" PRIu32, track->id, index);
        for (int entry = 0; entry < 8 && bucket[entry] != UINT32_MAX; entry++) {
            const uint32_t *cell = cells + 8 * (size_t)bucket[entry];
            print(out, " %" PRIu32 ":", cell[0]);
            for (int slot = 1; slot < 8 && cell[slot] != 0; slot++) {
                print(out, slot > 1 ? ",%0*" PRIx32 : "%0*" PRIx32, digits, cell[slot]);
            }
        }
        print(out, "\n");
    }
}

static void dump_volume(const dapple_track *track, text *out) {
    const dapple_volume *volume = &track->parameters.probes;
    print(out, "volume %" PRIu32 " %" PRIu32 " %" PRIu32 " %" PRIu32, track->id, volume->dims[0],
          volume->dims[1], volume->dims[2]);
    print(out, " %" PRId32 " %" PRIu32 " ", volume->exponent, volume->visibility_side);
    print(out, "%" PRIu16 ",%" PRIu16 " ", volume->visibility_steps[0], volume->visibility_steps[1]);
    for (int degree = 0; degree < 3; degree++) {
        print(out, degree ? ",%" PRIu32 ",%" PRIu32 : "%" PRIu32 ",%" PRIu32,
              volume->luma_steps[degree], volume->chroma_steps[degree]);
    }
    print_floats(out, volume->spacing, 3);
    print_floats(out, &volume->visibility_range, 1);
    print_floats(out, volume->grid_from_mesh, 12);
}

static void dump_probes(dapple_decoder *decoder, const dapple_track *track, text *out) {
    const dapple_volume *volume = &track->parameters.probes;
    size_t count = (size_t)volume->dims[0] * volume->dims[1] * volume->dims[2];
    for (size_t index = 0; index < count; index++) {
        dapple_probe probe;
        if (dapple_decoder_probes(decoder, track->id, index, 1, &probe) < 0) {
            quit("a probe of a track that there is");
        }
        if (probe.level == 0) {
            continue;
        }
        print(out, "probe %" PRIu32 " %zu %u ", track->id, index, probe.level);
        for (int code = 0; code < 27; code++) {
            print(out, code ? ",%04x" : "%04x", (unsigned)(uint16_t)probe.codes[code]);
        }
        print(out, "\n");
    }
    /* Values probe by probe, of the seven planes of four values. */
    const uint16_t *texels = array_of(decoder, DAPPLE_BUFFER_PROBES_TEXELS, track->id).data;
    unsigned char *bytes = malloc(54 * count);
    if (!bytes) {
        quit("out of memory");
    }
    for (size_t index = 0; index < count; index++) {
        for (size_t value = 0; value < 27; value++) {
            uint16_t half = texels[4 * (value / 4 * count + index) + value % 4];
            bytes[54 * index + 2 * value] = (unsigned char)(half & 0xff);
            bytes[54 * index + 2 * value + 1] = (unsigned char)(half >> 8);
        }
    }
    print(out, "values %" PRIu32 " %016" PRIx64 "\n", track->id, xxh64(bytes, 54 * count));
    free(bytes);
    dapple_array visibility = array_of(decoder, DAPPLE_BUFFER_PROBES_VISIBILITY, track->id);
    if (visibility.size > 0) {
        uint64_t digest = xxh64(visibility.data, visibility.size);
        print(out, "visibility %" PRIu32 " %016" PRIx64 "\n", track->id, digest);
    }
}

static void dump_signals(const dapple_signals *signals, text *out) {
    print(out, " %" PRIu32 " %" PRIu32 ",%" PRIu32, signals->count, signals->kinds[0],
          signals->kinds[1]);
    print_floats(out, signals->distances, 2);
    print_floats(out, &signals->share, 1);
}

static void dump_vertices(dapple_decoder *decoder, const dapple_track *track, text *out) {
    const dapple_vertices *vertices = &track->parameters.vertices;
    const unsigned char *values = array_of(decoder, DAPPLE_BUFFER_VERTICES_VALUES, track->id).data;
    values += vertices->first_value;
    for (uint32_t index = 0; index < vertices->count; index++) {
        uint32_t signals = vertices->signals.count;
        const unsigned char *of = values + (size_t)signals * index;
        if (of[0] == 255 && of[signals - 1] == 255) {
            continue;
        }
        print(out, "vertex %" PRIu32 " %" PRIu32 " %u", track->id, index, of[0]);
        print(out, signals > 1 ? ",%u\n" : "\n", of[signals - 1]);
    }
}

static void dump_instances(dapple_decoder *decoder, const dapple_track *track, text *out) {
    uint32_t signals = track->parameters.instances.signals.count;
    dapple_array keys = array_of(decoder, DAPPLE_BUFFER_INSTANCES_KEYS, track->id);
    const int16_t *values = array_of(decoder, DAPPLE_BUFFER_INSTANCES_VALUES, track->id).data;
    for (size_t entry = 0; entry < keys.size / keys.element_size; entry++) {
        print(out, "entry %" PRIu32 " %016" PRIx64, track->id, ((const uint64_t *)keys.data)[entry]);
        for (uint32_t number = 0; number < 4 * signals; number++) {
            unsigned value = (uint16_t)values[4 * signals * entry + number];
            print(out, number % 4 ? ",%04x" : " %04x", value);
        }
        print(out, "\n");
    }
}

static void dump_regions(dapple_decoder *decoder, const dapple_track *track, text *out) {
    dapple_array array = array_of(decoder, DAPPLE_BUFFER_REGIONS, track->id);
    const dapple_region *regions = array.data;
    const int16_t *pairs = array_of(decoder, DAPPLE_BUFFER_REGIONS_PAIRS, track->id).data;
    static const uint32_t derivatives[4] = {0, 3, 6, 0};
    for (size_t index = 0; index < array.size / array.element_size; index++) {
        const dapple_region *region = &regions[index];
        uint32_t form = region->form, degree = form >> 2 & 3, signals = (form >> 4 & 1) + 1;
        print(out, "region %" PRIu32 " %zu %" PRIu32, track->id, index, form & 3);
        print(out, ",%" PRIu32 ",%" PRIu32, degree, signals);
        print_floats(out, region->min, 3);
        print_floats(out, region->max, 3);
        if (form >> 5 & 1) {
            print(out, " - - -");
        } else {
            print_floats(out, region->centre, 3);
        }
        uint32_t count = (1 + derivatives[form & 3]) * (degree + 1) * (degree + 1) * signals;
        for (uint32_t value = 0; value < count; value++) {
            unsigned bits = (uint16_t)pairs[2 * (size_t)region->first + value];
            print(out, value ? ",%04x" : " %04x", bits);
        }
        print(out, "\n");
    }
}

static void dump_track(dapple_decoder *decoder, size_t index, text *out) {
    static const char *models[] = {"", "points", "probes", "vertices", "instances", "regions"};
    dapple_track track;
    if (dapple_decoder_track(decoder, index, &track) < 0 || track.model > 5) {
        quit("a track that there is");
    }
    const dapple_parameters *of = &track.parameters;
    print(out, "track %" PRIu32 " %s", track.id, models[track.model]);
    const char *coding = track.model == DAPPLE_MODEL_POINTS ? "cells" : track.coding ? "packed" : "raw";
    print(out, " %s %s %016" PRIx64 " ", coding, track.space ? "rest" : "mesh", track.application_id);
    if (track.has_content_hash) {
        print(out, "%016" PRIx64, track.content_hash);
    } else {
        print(out, "-");
    }
    print_floats(out, track.aabb_min, 3);
    print_floats(out, track.aabb_max, 3);
    print(out, " ");
    print_quoted(out, track.path, track.path_size);
    print(out, "\n");
    switch (track.model) {
    case DAPPLE_MODEL_POINTS:
        dump_grid(&track, out);
        break;
    case DAPPLE_MODEL_PROBES:
        dump_volume(&track, out);
        break;
    case DAPPLE_MODEL_VERTICES:
        print(out, "vertices %" PRIu32 " %" PRIu32 " %" PRIu32 " %" PRIu32, track.id,
              of->vertices.count, of->vertices.bits, of->vertices.order);
        dump_signals(&of->vertices.signals, out);
        break;
    case DAPPLE_MODEL_INSTANCES:
        print(out, "instances %" PRIu32 " %" PRIu32 " %" PRIu32 " %" PRIu32, track.id,
              of->instances.count, of->instances.exponent, of->instances.step);
        dump_signals(&of->instances.signals, out);
        break;
    default:
        print(out, "regions %" PRIu32 " %" PRIu32 " %" PRIu32, track.id, of->regions.count,
              of->regions.capacity);
        print(out, " %" PRIu32 " %" PRIu32, of->regions.exponent, of->regions.step);
        dump_signals(&of->regions.signals, out);
        break;
    }
    print(out, "\n");
    if (track.has_transform) {
        print(out, "transform %" PRIu32, track.id);
        print_floats(out, track.world_from_grid, 12);
        print(out, "\n");
    }
    switch (track.model) {
    case DAPPLE_MODEL_POINTS:
        dump_buckets(decoder, &track, out);
        break;
    case DAPPLE_MODEL_PROBES:
        dump_probes(decoder, &track, out);
        break;
    case DAPPLE_MODEL_VERTICES:
        dump_vertices(decoder, &track, out);
        break;
    case DAPPLE_MODEL_INSTANCES:
        dump_instances(decoder, &track, out);
        break;
    default:
        dump_regions(decoder, &track, out);
        break;
    }
}

static void dump_event(dapple_decoder *decoder, const dapple_event_info *event, text *out) {
    uint64_t digest = 0;
    switch (event->kind) {
    case DAPPLE_EVENT_STREAM:
        print(out, "stream %" PRIu32 " %" PRIu32 "\n", event->ticks, event->seconds);
        break;
    case DAPPLE_EVENT_GROUP:
        if (event->has_digest) {
            print(out, "group %" PRIu32 " state %016" PRIx64 "\n", event->group, event->digest);
        } else {
            print(out, "group %" PRIu32 " keyframes\n", event->group);
        }
        break;
    case DAPPLE_EVENT_FRAME:
        dapple_decoder_state_digest(decoder, &digest);
        print(out, "frame %" PRIu32 " %" PRIu64 " %016" PRIx64 "\n", event->frame.number,
              event->frame.tick, digest);
        for (size_t index = 0; index < dapple_decoder_track_count(decoder); index++) {
            dump_track(decoder, index, out);
        }
        break;
    case DAPPLE_EVENT_END:
        print(out, "end\n");
        break;
    default:
        break;
    }
}

/* ---- Requests ---- */

typedef struct {
    dapple_limits limits;
    bool live, partial, session, queries;
    size_t pieces;
} request;

/* Feeds all of the input, or up to a fault. Returns 0, or minus the id of an error. */
static int push(dapple_decoder *decoder, const unsigned char *input, size_t size, size_t pieces,
                text *out) {
    while (size > 0) {
        size_t piece = pieces > 0 && pieces < size ? pieces : size;
        size -= piece;
        while (piece > 0) {
            dapple_event_info event;
            size_t used = 0;
            int status = dapple_decoder_push(decoder, input, piece, &used, &event);
            input += used;
            piece -= used;
            if (status < 0) {
                return status;
            }
            dump_event(decoder, &event, out);
        }
    }
    return 0;
}

static const char *layer_name(uint32_t layer) {
    static const char *names[] = {"", "framing", "record", "codec", "session"};
    return layer < 5 ? names[layer] : "interface";
}

static int run_stream(dapple_decoder *decoder, const request *of, const unsigned char *input,
                      size_t size, text *out) {
    int status = push(decoder, input, size, of->pieces, out);
    if (status == 0) {
        if (of->partial && dapple_decoder_finish(decoder) < 0) {
            return NEED_INPUT;
        }
        status = of->live ? dapple_decoder_finish_live(decoder) : dapple_decoder_finish(decoder);
    }
    if (status == 0) {
        return COMPLETE;
    }
    dapple_error error;
    dapple_decoder_error(decoder, &error);
    print(out, "{\"layer\":\"%s\",\"id\":%" PRIu32 ",\"offset\":%" PRIu64 "}\n",
          layer_name(error.layer), error.id, error.offset);
    return REFUSED;
}

static int run_session(dapple_decoder *decoder, const request *of, const unsigned char *script,
                       size_t size, text *out) {
    const unsigned char *kept = script, *end = script + size;
    size_t kept_size = 0;
    while (script < end) {
        const unsigned char *line_end = memchr(script, '\n', (size_t)(end - script));
        char line[64] = {0};
        if (!line_end || (size_t)(line_end - script) >= sizeof line) {
            quit("a line of a script that has no end");
        }
        memcpy(line, script, (size_t)(line_end - script));
        script = line_end + 1;
        uint64_t before = dapple_decoder_position(decoder);
        const unsigned char *fed = script;
        size_t fed_size = 0;
        int status = 0;
        if (strncmp(line, "push ", 5) == 0) {
            fed_size = strtoull(line + 5, NULL, 10);
            if (fed_size > (size_t)(end - script)) {
                quit("a push of more bytes than follow");
            }
            script += fed_size;
            status = push(decoder, fed, fed_size, of->pieces, out);
        } else if (strcmp(line, "resume") == 0) {
            int resumed = dapple_decoder_resume(decoder);
            print(out, "resume %s\n", resumed ? "yes" : "no");
            if (resumed) {
                fed = kept;
                fed_size = kept_size;
                kept_size = 0;
                status = push(decoder, fed, fed_size, of->pieces, out);
            }
        } else if (strcmp(line, "reset") == 0) {
            dapple_decoder_reset(decoder);
            kept_size = 0;
            print(out, "reset\n");
        } else if (strcmp(line, "finish") == 0 || strcmp(line, "finish-live") == 0) {
            status = line[6] ? dapple_decoder_finish_live(decoder) : dapple_decoder_finish(decoder);
            if (status == 0) {
                print(out, "finished\n");
            }
        } else {
            quit("no such step of a session");
        }
        if (status < 0) {
            dapple_error error;
            dapple_decoder_error(decoder, &error);
            /* A push into a decoder that has stopped is lost; what it stopped in is not. */
            if (fed_size > 0 && error.id != 4011) {
                size_t used = (size_t)(dapple_decoder_position(decoder) - before);
                kept = fed + used;
                kept_size = fed_size - used;
            }
            print(out, "error %s %" PRIu32 " %" PRIu64 "\n", layer_name(error.layer), error.id,
                  error.offset);
        }
    }
    return COMPLETE;
}

/* Answers one request. */
static int answer(const request *of, const unsigned char *input, size_t size, text *out) {
    if (of->queries) {
        return NOT_IMPLEMENTED;
    }
    dapple_decoder *decoder = dapple_decoder_new(&of->limits);
    if (!decoder) {
        quit("out of memory");
    }
    print(out, "dapple-dump 1\n");
    int status = (of->session ? run_session : run_stream)(decoder, of, input, size, out);
    dapple_decoder_free(decoder);
    return status;
}

/* Sets a limit from `name=value`. */
static void set_limit(dapple_limits *limits, const char *pair) {
    const struct {
        const char *name;
        uint32_t *value;
    } fields[] = {
        {"stored_bytes=", &limits->stored_bytes},
        {"unpacked_bytes=", &limits->unpacked_bytes},
        {"frame_bytes=", &limits->frame_bytes},
        {"zstd_window_bytes=", &limits->zstd_window_bytes},
        {"tracks=", &limits->tracks},
        {"path_bytes=", &limits->path_bytes},
        {"work_per_byte=", &limits->work_per_byte},
    };
    if (strncmp(pair, "state_bytes=", 12) == 0) {
        limits->state_bytes = strtoull(pair + 12, NULL, 10);
        return;
    }
    for (size_t i = 0; i < sizeof fields / sizeof *fields; i++) {
        size_t length = strlen(fields[i].name);
        if (strncmp(pair, fields[i].name, length) == 0) {
            *fields[i].value = (uint32_t)strtoull(pair + length, NULL, 10);
            return;
        }
    }
    quit("no such limit");
}

static request parse(char **words, size_t count) {
    request of = {0};
    dapple_limits_default(&of.limits);
    for (size_t i = 0; i < count; i++) {
        const char *word = words[i];
        bool more = i + 1 < count;
        if (strcmp(word, "--session") == 0) {
            of.session = true;
        } else if (strcmp(word, "--queries") == 0) {
            of.queries = true;
        } else if (strcmp(word, "--live") == 0) {
            of.live = true;
        } else if (strcmp(word, "--partial") == 0) {
            of.partial = true;
        } else if (strcmp(word, "--pieces") == 0 && more) {
            of.pieces = strtoull(words[++i], NULL, 10);
        } else if (strcmp(word, "--limit") == 0 && more) {
            set_limit(&of.limits, words[++i]);
        } else {
            quit("no such argument");
        }
    }
    return of;
}

/* Reads a length and so many bytes; false at the end of the input. */
static bool read_part(text *part) {
    unsigned char length[4];
    if (fread(length, 1, 4, stdin) != 4) {
        return false;
    }
    part->size = 0;
    for (size_t left = (size_t)little(length, 4); left > 0;) {
        char bytes[4096];
        size_t got = fread(bytes, 1, left < sizeof bytes ? left : sizeof bytes, stdin);
        if (got == 0) {
            quit("a request is cut off");
        }
        append(part, bytes, got);
        left -= got;
    }
    append(part, "", 1);
    part->size--;
    return true;
}

static void batch(void) {
    text arguments = {0}, input = {0}, out = {0};
    while (read_part(&arguments)) {
        char *words[64];
        size_t count = 0;
        for (char *word = strtok(arguments.bytes, " "); word && count < 64; word = strtok(NULL, " ")) {
            words[count++] = word;
        }
        if (!read_part(&input)) {
            quit("a request without input");
        }
        request of = parse(words, count);
        out.size = 0;
        int status = answer(&of, (const unsigned char *)input.bytes, input.size, &out);
        unsigned char head[5] = {(unsigned char)status};
        for (int i = 0; i < 4; i++) {
            head[1 + i] = (unsigned char)(out.size >> (8 * i));
        }
        fwrite(head, 1, 5, stdout);
        fwrite(out.bytes, 1, out.size, stdout);
        fflush(stdout);
    }
    free(arguments.bytes);
    free(input.bytes);
    free(out.bytes);
}

int main(int count, char **words) {
    if (dapple_abi_version() != DAPPLE_ABI_VERSION) {
        quit("the library is of another version than the header");
    }
    if (count == 2 && strcmp(words[1], "--batch") == 0) {
        batch();
        return 0;
    }
    request of = parse(words + 1, (size_t)count - 1);
    text input = {0}, out = {0};
    char bytes[4096];
    for (size_t got; (got = fread(bytes, 1, sizeof bytes, stdin)) > 0;) {
        append(&input, bytes, got);
    }
    int status = answer(&of, (const unsigned char *)input.bytes, input.size, &out);
    fwrite(out.bytes, 1, out.size, stdout);
    free(input.bytes);
    free(out.bytes);
    return status;
}
