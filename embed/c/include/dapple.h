// C interface of Dapple: decoder and encoder. Generated from embed/c/src by cbindgen; `docs/embedding.md` is the guide.
// SPDX-License-Identifier: MIT OR Apache-2.0

#ifndef DAPPLE_H
#define DAPPLE_H

#include <stddef.h>
#include <stdint.h>

/*
 * Functions that can fail return 0 or more, or minus the id of an error: one of the format, as
 * spec/README.md lists them, or DAPPLE_ERROR_*. No exception or longjmp leaves a function.
 *
 * A pointer may be null only where a comment says so; where it is null and must not be, the function
 * gives DAPPLE_ERROR_ARGUMENT. What a function writes through a pointer is left alone after an error.
 * A handle is used by one thread at a time. Different handles are independent.
 */

// Version of this interface: `DAPPLE_ABI_VERSION` of the header that a program was compiled with must be
// equal to [`dapple_abi_version`] of the library that it runs with.
#define DAPPLE_ABI_VERSION 1

// An argument is null where it must not be, not aligned, or out of range.
#define DAPPLE_ERROR_ARGUMENT 9001

// The library stopped at a defect of its own. The handle has to be reset or freed.
#define DAPPLE_ERROR_PANIC 9002

// There is no such track.
#define DAPPLE_ERROR_NO_TRACK 9003

// The library was built without what was asked for.
#define DAPPLE_ERROR_NOT_BUILT 9004

// What a call of `dapple_decoder_push` came to.
typedef enum {
    // All input was used; push more.
    DAPPLE_EVENT_NEED_INPUT = 0,
    // The stream's tick rate is known.
    DAPPLE_EVENT_STREAM = 1,
    // A group starts.
    DAPPLE_EVENT_GROUP = 2,
    // Tracks were declared: tracks and arrays have grown.
    DAPPLE_EVENT_TRACKS = 3,
    // A frame was committed: upload the dirty ranges.
    DAPPLE_EVENT_FRAME = 4,
    // A record of an unknown type was skipped; it said that it may be.
    DAPPLE_EVENT_SKIPPED = 5,
    // The stream is complete.
    DAPPLE_EVENT_END = 6,
} dapple_event;

// An array of decoded state.
typedef enum {
    // Hash buckets of all tracks of `points`: 8 `uint32_t` each.
    DAPPLE_BUFFER_POINTS_BUCKETS = 0,
    // Cells of all tracks of `points`: key and 7 points, `uint32_t` each.
    DAPPLE_BUFFER_POINTS_CELLS = 1,
    // Texels of a track of `probes`: 4 half floats each, seven planes of one texel a probe.
    DAPPLE_BUFFER_PROBES_TEXELS = 2,
    // Visibility of a track of `probes`: bytes.
    DAPPLE_BUFFER_PROBES_VISIBILITY = 3,
    // Values of all tracks of `vertices`: a byte each.
    DAPPLE_BUFFER_VERTICES_VALUES = 4,
    // Keys of a track of `instances`: `uint64_t` each.
    DAPPLE_BUFFER_INSTANCES_KEYS = 5,
    // Values of a track of `instances`: 4 `int16_t` each.
    DAPPLE_BUFFER_INSTANCES_VALUES = 6,
    // Regions of a track of `regions`: `dapple_region` each.
    DAPPLE_BUFFER_REGIONS = 7,
    // Coefficients of a track of `regions`: 2 `int16_t` each.
    DAPPLE_BUFFER_REGIONS_PAIRS = 8,
    // Transform of a track of any model: 12 `float`, or nothing.
    DAPPLE_BUFFER_TRANSFORMS = 9,
} dapple_buffer;

// A model.
typedef enum {
    // Ambient occlusion at surface points.
    DAPPLE_MODEL_POINTS = 1,
    // Indirect light at the probes of a volume.
    DAPPLE_MODEL_PROBES = 2,
    // Ambient obscurance at the vertices of a mesh.
    DAPPLE_MODEL_VERTICES = 3,
    // Ambient obscurance of whole mesh instances.
    DAPPLE_MODEL_INSTANCES = 4,
    // Ambient obscurance in boxes of the world.
    DAPPLE_MODEL_REGIONS = 5,
} dapple_model;

// A field of `dapple_limits`, in errors of the class `LimitExceeded`.
typedef enum {
    // No limit.
    DAPPLE_LIMIT_NONE = 0,
    // `stored_bytes`.
    DAPPLE_LIMIT_STORED_BYTES = 1,
    // `unpacked_bytes`.
    DAPPLE_LIMIT_UNPACKED_BYTES = 2,
    // `frame_bytes`.
    DAPPLE_LIMIT_FRAME_BYTES = 3,
    // `zstd_window_bytes`.
    DAPPLE_LIMIT_ZSTD_WINDOW_BYTES = 4,
    // `tracks`.
    DAPPLE_LIMIT_TRACKS = 5,
    // `path_bytes`.
    DAPPLE_LIMIT_PATH_BYTES = 6,
    // `state_bytes`.
    DAPPLE_LIMIT_STATE_BYTES = 7,
    // `work_per_byte`.
    DAPPLE_LIMIT_WORK_PER_BYTE = 8,
} dapple_limit;

// The layer that an error belongs to: the thousands of its id.
typedef enum {
    // There is no error.
    DAPPLE_LAYER_NONE = 0,
    // Preamble, record headers, checksums, compression.
    DAPPLE_LAYER_FRAMING = 1,
    // The fields of a record.
    DAPPLE_LAYER_RECORD = 2,
    // The contents of a model's payload.
    DAPPLE_LAYER_CODEC = 3,
    // The order of records and the state they build.
    DAPPLE_LAYER_SESSION = 4,
    // The use of this interface; no fault of the bytes.
    DAPPLE_LAYER_INTERFACE = 9,
} dapple_layer;

// The class of an error, which a program may branch on.
typedef enum {
    // There is no error.
    DAPPLE_CLASS_NONE = 0,
    // The bytes break a rule of the format.
    DAPPLE_CLASS_MALFORMED = 1,
    // The input ends too early.
    DAPPLE_CLASS_TRUNCATED = 2,
    // The bytes may be right, but need a newer or larger decoder.
    DAPPLE_CLASS_UNSUPPORTED = 3,
    // A checksum or digest does not match.
    DAPPLE_CLASS_CHECKSUM = 4,
    // The stream asks for more than a limit allows.
    DAPPLE_CLASS_LIMIT_EXCEEDED = 5,
    // A delta or a group builds on a state that this decoder does not hold.
    DAPPLE_CLASS_MISSING_BASE = 6,
    // The caller used the library out of order; no fault of the bytes.
    DAPPLE_CLASS_USAGE = 7,
    // The machine does not have memory that the limits allow; no fault of the bytes.
    DAPPLE_CLASS_OUT_OF_MEMORY = 8,
} dapple_class;

// How the payloads of an encoder's call are packed.
typedef enum {
    // Not at all.
    DAPPLE_COMPRESSION_NONE = 0,
    // lz4: the fastest to unpack.
    DAPPLE_COMPRESSION_LZ4 = 1,
    // zstd at level 15. Needs a library that was built with `zstd-native`.
    DAPPLE_COMPRESSION_ZSTD = 2,
} dapple_compression;

// What an encoder's call says about the tracks that it names.
typedef enum {
    // Everything: what is not sent is empty.
    DAPPLE_COVERAGE_KEYFRAME = 0,
    // What changed since the last committed frame.
    DAPPLE_COVERAGE_DELTA = 1,
} dapple_coverage;

// A decoder for one stream after another.
typedef struct dapple_decoder dapple_decoder;

// Writes a stream, record by record. Unlike a decoder, it ends the program where memory runs out.
typedef struct dapple_encoder dapple_encoder;

// Returns `size` bytes at a multiple of `alignment`, a power of two; null where there is no memory.
typedef void *(*dapple_allocate)(size_t size, size_t alignment);

// Frees what the other function returned for the same size and alignment.
typedef void (*dapple_deallocate)(void *memory, size_t size, size_t alignment);

// Elements `start` to `end` (excluded) of an array that changed. Of an array that became empty both are 0.
typedef struct {
    // `DAPPLE_BUFFER_*`.
    uint32_t buffer;
    // Id of the track whose array it is; 0 for an array of all tracks.
    uint32_t track;
    // First element.
    uint32_t start;
    // One past the last element.
    uint32_t end;
} dapple_dirty_range;

// An array as the bytes that a GPU reads, in the machine's order. The pointers hold until the next call that
// takes the decoder, other than one that only asks.
typedef struct {
    // All of it, dirty or not.
    const void *data;
    // Bytes of all of it.
    size_t size;
    // Bytes of an element.
    size_t element_size;
    // What changed since `dapple_decoder_clear_dirty`: ranges ascend and do not touch.
    const dapple_dirty_range *dirty;
    // Number of those ranges.
    size_t dirty_count;
} dapple_array;

// Upper bounds that every length in a stream is compared with before memory is reserved for it.
// `dapple_limits_default` fills it.
typedef struct {
    // Bytes of decoded state of all tracks.
    uint64_t state_bytes;
    // Bytes of one record's payload as stored.
    uint32_t stored_bytes;
    // Bytes of one record's payload unpacked.
    uint32_t unpacked_bytes;
    // Unpacked bytes of all model records of one frame.
    uint32_t frame_bytes;
    // Window of a zstd frame.
    uint32_t zstd_window_bytes;
    // Tracks that are declared and not removed.
    uint32_t tracks;
    // UTF-8 bytes of a track's path.
    uint32_t path_bytes;
    // Steps of work for each byte of the stream so far.
    uint32_t work_per_byte;
    // 0.
    uint32_t reserved;
} dapple_limits;

// A frame that was committed.
typedef struct {
    // Time in ticks.
    uint64_t tick;
    // Frame number; ascends, and may leave numbers out.
    uint32_t number;
    // Transforms that the frame carried.
    uint32_t transforms;
    // Items of each model that the frame carried, at `DAPPLE_MODEL_*`; the first is 0.
    uint32_t items[6];
} dapple_frame;

// What an event says; fields of other events are 0.
typedef struct {
    // `DAPPLE_EVENT_*`.
    uint32_t kind;
    // Number of the group that starts.
    uint32_t group;
    // Digest of the state that the group builds on, if `has_digest` is 1.
    uint64_t digest;
    // Whether the group builds on a state; if not, it starts from keyframes.
    uint32_t has_digest;
    // Tracks that are new.
    uint32_t tracks_added;
    // Type of the record that was skipped.
    uint32_t record_type;
    // Its payload bytes.
    uint32_t stored_bytes;
    // Ticks...
    uint32_t ticks;
    // ...in so many seconds.
    uint32_t seconds;
    // The frame that was committed.
    dapple_frame frame;
} dapple_event_info;

// What went wrong, and where. All zeros where nothing did.
typedef struct {
    // Stable id: of the format as `spec/README.md` lists it, such as 3005, or `DAPPLE_ERROR_*`.
    uint32_t id;
    // `DAPPLE_LAYER_*`.
    uint32_t layer;
    // `DAPPLE_CLASS_*`.
    uint32_t class_;
    // The limit that is exceeded, `DAPPLE_LIMIT_*`, or 0.
    uint32_t limit;
    // Byte offset in the stream: of the preamble, the record header or the record payload at fault. For an
    // encoder, the number of bytes written so far.
    uint64_t offset;
    // What the stream asks of that limit.
    uint64_t asked;
    // What the limit allows.
    uint64_t allowed;
    // The number that the stream has in the place of one that is known, if `has_found` is 1.
    uint64_t found;
    // Whether `found` has a value.
    uint32_t has_found;
    // The track whose declaration is at fault, if `has_track` is 1.
    uint32_t track;
    // Whether `track` has a value.
    uint32_t has_track;
    // 0.
    uint32_t reserved;
} dapple_error;

// How a stream is written. `dapple_encoder_config_default` fills it.
typedef struct {
    // Limits of the decoders that shall read the stream: what exceeds them is refused.
    dapple_limits limits;
    // Ticks...
    uint32_t ticks;
    // ...in so many seconds.
    uint32_t seconds;
} dapple_encoder_config;

// Parameters of a track of `points`.
typedef struct {
    // Rows of a 3x4 matrix, grid space from mesh space: metres with scale applied.
    float grid_from_mesh[12];
    // Cells along x, y, z.
    uint32_t dims[3];
    // Edge of a cell in metres.
    float cell_edge;
    // Interpolation radius in metres.
    float radius;
    // Bits of each of three position coordinates.
    uint32_t position_bits;
    // Bits of each of two octahedral coordinates.
    uint32_t normal_bits;
    // Bits of the AO value.
    uint32_t ao_bits;
    // Number of buckets.
    uint32_t bucket_count;
    // Cells that the track may hold.
    uint32_t cell_capacity;
    // Of a decoder: index of its first bucket in `DAPPLE_BUFFER_POINTS_BUCKETS`.
    uint32_t first_bucket;
    // Of a decoder: index of its first cell in `DAPPLE_BUFFER_POINTS_CELLS`.
    uint32_t first_cell;
} dapple_grid;

// Parameters of a track of `probes`.
typedef struct {
    // Rows of a 3x4 matrix, grid space from mesh space: metres, rigid, origin at the first probe.
    float grid_from_mesh[12];
    // Probes along x, y, z.
    uint32_t dims[3];
    // Metres between probes along x, y, z.
    float spacing[3];
    // A decoded value is a half float times two to this power.
    int32_t exponent;
    // Texels along a side of a probe's visibility map; 0 where there is none.
    uint32_t visibility_side;
    // Metres that a mean distance of 255 stands for; 0 where there is no map.
    float visibility_range;
    // Steps of luma for degrees 0, 1 and 2; 0 in the coding 0 (`raw`).
    uint32_t luma_steps[3];
    // Steps of chroma.
    uint32_t chroma_steps[3];
    // Steps of means and of deviations in maps; 0 where there is no map, and in the coding 0 (`raw`).
    uint16_t visibility_steps[2];
} dapple_volume;

// What the values of a baked track are.
typedef struct {
    // Signals of a value: 1 or 2.
    uint32_t count;
    // Kernel of each: 0 none, 1 exponential, 2 cut-off.
    uint32_t kinds[2];
    // Distance of each kernel in metres.
    float distances[2];
    // Share of the second kernel, 0 to 1.
    float share;
} dapple_signals;

// Parameters of a track of `vertices`.
typedef struct {
    // What a value is.
    dapple_signals signals;
    // Vertices.
    uint32_t count;
    // Bits of a value: 8 or 5.
    uint32_t bits;
    // Which vertex has which value: 0 as in the file, 1 distinct vertices in order.
    uint32_t order;
    // Of a decoder: index of its first value in `DAPPLE_BUFFER_VERTICES_VALUES`.
    uint32_t first_value;
} dapple_vertices;

// Parameters of a track of `instances`.
typedef struct {
    // What the values are.
    dapple_signals signals;
    // Entries.
    uint32_t count;
    // A coefficient of 32767 is two to this power.
    uint32_t exponent;
    // Step of the quantiser in 1/32767 of that.
    uint32_t step;
} dapple_instances;

// Parameters of a track of `regions`.
typedef struct {
    // What the values are.
    dapple_signals signals;
    // Regions.
    uint32_t count;
    // Pairs of coefficients that all regions together may have.
    uint32_t capacity;
    // A coefficient is a value / 32767, times two to this power.
    uint32_t exponent;
    // A value is a code times this.
    uint32_t step;
} dapple_regions;

// Parameters of a track: the member that its model names.
typedef union {
    // `DAPPLE_MODEL_POINTS`.
    dapple_grid points;
    // `DAPPLE_MODEL_PROBES`.
    dapple_volume probes;
    // `DAPPLE_MODEL_VERTICES`.
    dapple_vertices vertices;
    // `DAPPLE_MODEL_INSTANCES`.
    dapple_instances instances;
    // `DAPPLE_MODEL_REGIONS`.
    dapple_regions regions;
} dapple_parameters;

// A track.
typedef struct {
    // A number that the application gives a meaning to; 0 where it has none.
    uint64_t application_id;
    // Hash of the mesh that the content depends on, if `has_content_hash` is 1.
    uint64_t content_hash;
    // Id, which no other track of the stream has or had.
    uint32_t id;
    // `DAPPLE_MODEL_*`.
    uint32_t model;
    // Number of the model's coding: 0 for `cells` of points and `raw` of others, 1 for `packed`.
    uint32_t coding;
    // The space that a fragment is looked up in: 0 mesh space as drawn, 1 rest pose.
    uint32_t space;
    // Whether there is a content hash.
    uint32_t has_content_hash;
    // Of a decoder: whether there is a transform.
    uint32_t has_transform;
    // Smallest corner of its bounds.
    float aabb_min[3];
    // Largest corner.
    float aabb_max[3];
    // Of a decoder: rows of the last transform, world space from grid space, a 3x4 matrix.
    float world_from_grid[12];
    // Parameters of its model.
    dapple_parameters parameters;
    // Path of the node, UTF-8, not ended by a 0. Of a decoder it holds until the next push or reset.
    const char *path;
    // Bytes of the path.
    size_t path_size;
} dapple_track;

// A transform of a track.
typedef struct {
    // Id of the track.
    uint32_t track;
    // Rows of a 3x4 matrix, world space from grid space: a rotation and a translation.
    float world_from_grid[12];
} dapple_transform;

// Content of a track of `points` for one frame. Indices count within the track and ascend strictly.
typedef struct {
    // Id of the track.
    uint32_t track;
    // 0.
    uint32_t reserved;
    // Indices of the buckets.
    const uint32_t *bucket_indices;
    // Whole buckets, 8 words each.
    const uint32_t *buckets;
    // Number of buckets.
    size_t bucket_count;
    // Indices of the cells.
    const uint32_t *cell_indices;
    // Whole cells, 8 words each: key and 7 points.
    const uint32_t *cells;
    // Number of cells.
    size_t cell_count;
} dapple_points_update;

// A probe as it is coded.
typedef struct {
    // Degrees that are there: 0 for an absent probe, 1, 2 or 3.
    uint16_t level;
    // Codes, 0 above the level.
    int16_t codes[27];
} dapple_probe;

// Content of a track of `probes` for one frame.
typedef struct {
    // Id of the track.
    uint32_t track;
    // 0.
    uint32_t reserved;
    // All its probes in the last committed frame, for a delta; not looked at in a keyframe.
    const dapple_probe *base;
    // All its probes.
    const dapple_probe *probes;
    // Number of probes.
    size_t count;
    // Its visibility block where it is sent, or null.
    const uint8_t *visibility;
    // Bytes of that block.
    size_t visibility_size;
} dapple_probes_update;

// Content of a track of `vertices`.
typedef struct {
    // Id of the track.
    uint32_t track;
    // 0.
    uint32_t reserved;
    // The code of each value, signals of a vertex side by side: 0 to 255, or to 31 at 5 bits.
    const uint8_t *codes;
    // Number of codes.
    size_t count;
} dapple_vertices_update;

// An entry of a track of `instances`.
typedef struct {
    // XXH64 of the path of the mesh instance (`dapple_instance_key`).
    uint64_t key;
    // 1 for four coefficients of each signal, 0 for one.
    uint32_t linear;
    // 0.
    uint32_t reserved;
    // Codes of each signal; 0 where there is none.
    int16_t codes[2][4];
} dapple_instance_entry;

// Content of a track of `instances`: all of it.
typedef struct {
    // Id of the track.
    uint32_t track;
    // 0.
    uint32_t reserved;
    // Its entries, keys ascending.
    const dapple_instance_entry *entries;
    // Number of entries.
    size_t count;
} dapple_instances_update;

// A region.
typedef struct {
    // Smallest corner of its box in metres.
    float min[3];
    // Index of its first pair of coefficients among those of the track.
    uint32_t first;
    // Largest corner.
    float max[3];
    // Bits of its form: derivatives 0 and 1, degree 2 and 3, signals less one 4, centred 5.
    uint32_t form;
    // What offsets count from.
    float centre[3];
    // 0.
    uint32_t reserved;
} dapple_region;

// Content of a track of `regions`: all of it.
typedef struct {
    // Id of the track.
    uint32_t track;
    // 0.
    uint32_t reserved;
    // Its regions, as many as it declares.
    const dapple_region *regions;
    // Number of regions.
    size_t region_count;
    // Their coefficients, two `int16_t` a pair; those of each region follow those of the one before.
    const int16_t *pairs;
    // Number of pairs.
    size_t pair_count;
} dapple_regions_update;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

// [`ABI_VERSION`] of this library.
uint32_t dapple_abi_version(void);

// Makes all memory of the library come from these functions, which any thread may call at any time. Call it
// before any other function: -9001 where the library has memory already, or a function is null.
int32_t dapple_set_allocator(dapple_allocate allocate,
                             dapple_deallocate deallocate);

// Gives the list of all that changed since `dapple_decoder_clear_dirty`, in every array of every
// model, and how many ranges it has. The ranges of an array stand together and ascend.
int32_t dapple_decoder_dirty(dapple_decoder *decoder,
                             const dapple_dirty_range **ranges,
                             size_t *count);

// The dirty ranges have been uploaded.
int32_t dapple_decoder_clear_dirty(dapple_decoder *decoder);

// Writes an array, `DAPPLE_BUFFER_*`, with its dirty ranges. `track` is the id of its track, and is not looked
// at for an array of all tracks. The array is empty where the track is of another model.
int32_t dapple_decoder_array(dapple_decoder *decoder,
                             uint32_t buffer,
                             uint32_t track,
                             dapple_array *array);

// A decoder. Null where there is no memory for it. Null `limits` are the default ones.
dapple_decoder *dapple_decoder_new(const dapple_limits *limits);

// Frees a decoder and all its memory. Null is left alone.
void dapple_decoder_free(dapple_decoder *decoder);

// Feeds bytes, and returns what they came to: `DAPPLE_EVENT_*`, or minus the id of an error. Push the rest
// again, until `DAPPLE_EVENT_NEED_INPUT`. `used` gets the number of bytes that were used, in both cases;
// `event`, if not null, what the event says.
//
// After an error the state of the last frame stays, and every push gives 4011 until `dapple_decoder_resume`
// or `dapple_decoder_reset`.
int32_t dapple_decoder_push(dapple_decoder *decoder,
                            const uint8_t *bytes,
                            size_t size,
                            size_t *used,
                            dapple_event_info *event);

// Ends the input. 0 if the stream is complete; -1019 if it is not, -4011 after an error. The decoder may be fed on.
int32_t dapple_decoder_finish(dapple_decoder *decoder);

// Ends the input of a live stream, which may stop after any frame. 0, or -1019 inside a record, -4006 inside a
// frame, -4011 after an error.
int32_t dapple_decoder_finish_live(dapple_decoder *decoder);

// After an error: goes on at the next group that can be decoded. 1, or 0 where only `dapple_decoder_reset` helps.
// Push from `dapple_decoder_position` on. Without an error it is without effect.
int32_t dapple_decoder_resume(dapple_decoder *decoder);

// Forgets the stream and its state; keeps limits and memory. The next byte starts a stream.
int32_t dapple_decoder_reset(dapple_decoder *decoder);

// Bytes of the stream used so far.
uint64_t dapple_decoder_position(const dapple_decoder *decoder);

// Steps of work for this stream so far; a step takes some 10 ns.
uint64_t dapple_decoder_work(const dapple_decoder *decoder);

// Writes the digest of the state of the last frame, the same from every decoder. Takes time: it reads the state.
int32_t dapple_decoder_state_digest(dapple_decoder *decoder,
                                    uint64_t *digest);

// Writes the last error of a call with this decoder; all zeros where there was none.
void dapple_decoder_error(const dapple_decoder *decoder, dapple_error *error);

// Writes the last error as a sentence and a 0 to `out`, which has `size` bytes; what does not fit is cut off.
// Returns the length of the sentence.
size_t dapple_decoder_error_message(const dapple_decoder *decoder,
                                    char *out,
                                    size_t size);

// Writes the default configuration: 60 ticks a second, default limits.
void dapple_encoder_config_default(dapple_encoder_config *config);

// An encoder, which has written the head of its stream. Null `config` is the default one. Null where there
// is no memory, or the configuration is refused; `status`, if not null, gets 0 or minus the id of an error.
dapple_encoder *dapple_encoder_new(const dapple_encoder_config *config,
                                   int32_t *status);

// Frees an encoder and the bytes that it still has. Null is left alone.
void dapple_encoder_free(dapple_encoder *encoder);

// Declares tracks, ids ascending: `id`, `model`, `coding`, `space`, bounds, path and parameters of each, and
// `content_hash` and `application_id` where it has them.
int32_t dapple_encoder_tracks(dapple_encoder *encoder,
                              const dapple_track *tracks,
                              size_t count);

// Ends tracks at the next commit; ids ascend.
int32_t dapple_encoder_remove_tracks(dapple_encoder *encoder, const uint32_t *ids, size_t count);

// Starts a group. Without a `digest` (null) its first frame must have a keyframe of every track that is not to
// be empty; with one it builds on the state of that digest, which is that of the last commit.
int32_t dapple_encoder_group(dapple_encoder *encoder,
                             const uint64_t *digest);

// Transforms of the frame, ids ascending; at most one call a frame.
int32_t dapple_encoder_transforms(dapple_encoder *encoder,
                                  const dapple_transform *transforms,
                                  size_t count);

// Makes the frame visible at a tick, which may not be before the last one's. Returns the frame's number in
// the lower 31 bits, or minus the id of an error.
int32_t dapple_encoder_commit(dapple_encoder *encoder,
                              uint64_t tick);

// Ends the stream; every call that writes is refused after it.
int32_t dapple_encoder_end(dapple_encoder *encoder);

// Writes where the bytes are that were written since `dapple_encoder_clear`, and how many. They hold until the
// next call that writes.
int32_t dapple_encoder_bytes(dapple_encoder *encoder,
                             const uint8_t **bytes,
                             size_t *size);

// Forgets the bytes that were taken; keeps the memory.
int32_t dapple_encoder_clear(dapple_encoder *encoder);

// Writes the digest of the state of the last commit.
int32_t dapple_encoder_state_digest(dapple_encoder *encoder, uint64_t *digest);

// Writes the last error of a call with this encoder; all zeros where there was none.
void dapple_encoder_error(const dapple_encoder *encoder, dapple_error *error);

// Writes the last error as a sentence and a 0 to `out`, which has `size` bytes; what does not fit is cut off.
// Returns the length of the sentence.
size_t dapple_encoder_error_message(const dapple_encoder *encoder,
                                    char *out,
                                    size_t size);

// Content of the frame for tracks of `points`, ids ascending; each track at most once a frame. `coverage` is
// `DAPPLE_COVERAGE_*`, `compression` is `DAPPLE_COMPRESSION_*`.
int32_t dapple_encoder_points(dapple_encoder *encoder,
                              uint32_t coverage,
                              const dapple_points_update *updates,
                              size_t count,
                              uint32_t compression);

// Content of the frame for tracks of `probes`, ids ascending; each track at most once a frame.
int32_t dapple_encoder_probes(dapple_encoder *encoder,
                              uint32_t coverage,
                              const dapple_probes_update *updates,
                              size_t count,
                              uint32_t compression);

// Content of the frame for tracks of `vertices`, ids ascending: all values of each.
int32_t dapple_encoder_vertices(dapple_encoder *encoder,
                                const dapple_vertices_update *updates,
                                size_t count,
                                uint32_t compression);

// Content of the frame for tracks of `instances`, ids ascending: all entries of each.
int32_t dapple_encoder_instances(dapple_encoder *encoder,
                                 const dapple_instances_update *updates,
                                 size_t count,
                                 uint32_t compression);

// Content of the frame for tracks of `regions`, ids ascending: all regions of each.
int32_t dapple_encoder_regions(dapple_encoder *encoder,
                               const dapple_regions_update *updates,
                               size_t count,
                               uint32_t compression);

// A packed point: `position` in units of the cell's edge, 0 to 1; a unit normal; AO from 0 (closed) to 1
// (open). 0 for a null pointer or widths that no track may have.
uint32_t dapple_points_pack(const dapple_grid *grid,
                            const float *position,
                            const float *normal,
                            float ao);

// The key of a cell: `x + dims[0] * (y + dims[1] * z)`, mod 2^32. 0 for a null pointer.
uint32_t dapple_points_key(const dapple_grid *grid, uint32_t x, uint32_t y, uint32_t z);

// The bucket that a key hashes to. 0 for a null pointer or a grid that no track may have.
uint32_t dapple_points_bucket(const dapple_grid *grid, uint32_t key);

// The key of a mesh instance by its path, which has `size` bytes of UTF-8. 0 where it is not UTF-8.
uint64_t dapple_instance_key(const char *path, size_t size);

// Writes the short, stable name of an error, such as `header-checksum`, and a 0 to `out`, which has `size`
// bytes; what does not fit is cut off. Returns the length of the name.
size_t dapple_error_name(uint32_t id,
                         char *out,
                         size_t size);

// Writes the default limits, which suit scenes of some hundred megabytes.
void dapple_limits_default(dapple_limits *limits);

// The most bytes that a decoder with these limits ever has allocated at once, whatever it is fed. Null
// stands for the default limits.
uint64_t dapple_limits_heap_bytes(const dapple_limits *limits);

// Number of declared tracks that were not removed.
size_t dapple_decoder_track_count(const dapple_decoder *decoder);

// Writes the track at an index below `dapple_decoder_track_count`; ids ascend.
int32_t dapple_decoder_track(dapple_decoder *decoder, size_t index, dapple_track *track);

// Writes the track of an id.
int32_t dapple_decoder_find_track(dapple_decoder *decoder, uint32_t id, dapple_track *track);

// Writes `count` probes of a track from `first` on, as they are coded: a level of 0 says that a probe is
// absent. Texels are what a sampler reads.
int32_t dapple_decoder_probes(dapple_decoder *decoder,
                              uint32_t track,
                              size_t first,
                              size_t count,
                              dapple_probe *probes);

// Writes a bit for each probe of a track, 1 where it is present, the lowest bit of the first word first:
// `(probes + 31) / 32` words, which must be `words`.
int32_t dapple_decoder_presence(dapple_decoder *decoder,
                                uint32_t track,
                                uint32_t *bits,
                                size_t words);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* DAPPLE_H */
