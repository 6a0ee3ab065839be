// Decoder of Dapple streams as an ES module over WebAssembly. `docs/embedding.md` is the guide, `dapple.d.ts` the
// interface. The numbers and struct layouts are those of `embed/c/include/dapple.h` with pointers of 32 bits.

/** Version of the C interface that this file is written for. */
const ABI_VERSION = 1;

const EVENTS = ['need-input', 'stream', 'group', 'tracks', 'frame', 'skipped', 'end'];
const MODELS = ['', 'points', 'probes', 'vertices', 'instances', 'regions'];
const LAYERS = ['', 'framing', 'record', 'codec', 'session', '', '', '', '', 'interface'];
const CLASSES = [
    '', 'Malformed', 'Truncated', 'Unsupported', 'Checksum', 'LimitExceeded', 'MissingBase', 'Usage', 'OutOfMemory',
];

/** Arrays of decoded state, by name. */
export const Buffer = Object.freeze({
    PointsBuckets: 0,
    PointsCells: 1,
    ProbesTexels: 2,
    ProbesVisibility: 3,
    VerticesValues: 4,
    InstancesKeys: 5,
    InstancesValues: 6,
    Regions: 7,
    RegionsPairs: 8,
    Transforms: 9,
});

/** Arrays of all tracks of a model. */
const SHARED = new Set([Buffer.PointsBuckets, Buffer.PointsCells, Buffer.VerticesValues]);

/** What the elements of each array are made of. `Regions` is 12 words: floats, but for words 3 and 7. */
const VIEWS = [
    Uint32Array, Uint32Array, Uint16Array, Uint8Array, Uint8Array, BigUint64Array, Int16Array, Float32Array,
    Int16Array, Float32Array,
];

/** Offsets in `dapple_limits`. */
const LIMITS = {
    stored_bytes: 8,
    unpacked_bytes: 12,
    frame_bytes: 16,
    zstd_window_bytes: 20,
    tracks: 24,
    path_bytes: 28,
    work_per_byte: 32,
};
const LIMIT_NAMES = [
    '', 'stored_bytes', 'unpacked_bytes', 'frame_bytes', 'zstd_window_bytes', 'tracks', 'path_bytes', 'state_bytes',
    'work_per_byte',
];

/** Offset of the path in `dapple_track`, behind the largest parameters. */
const PATH = 224;

/** Bytes of input that are copied into the module at a time. */
const PIECE = 1 << 18;
/** Memory for results of calls. */
const SCRATCH = 512;

/** An error of a stream, or of the use of a decoder. */
export class DappleError extends Error {
    constructor(message, details) {
        super(message);
        this.name = 'DappleError';
        Object.assign(this, details);
    }
}

let compiled;

/**
 * Loads the module, once; later calls give the same promise. Without a source it is `dapple.wasm` beside this file.
 */
export function load(source) {
    compiled ??= compile(source ?? new URL('./dapple.wasm', import.meta.url)).catch((error) => {
        compiled = undefined;
        throw error;
    });
    return compiled.then((module) => {
        Decoder.module = module;
        return module;
    });
}

async function compile(source) {
    if (source instanceof WebAssembly.Module) return source;
    if (ArrayBuffer.isView(source) || source instanceof ArrayBuffer) return WebAssembly.compile(source);
    if (!(source instanceof Response)) {
        if (new URL(source, globalThis.location?.href).protocol === 'file:' && globalThis.process?.versions?.node) {
            const { readFile } = await import('node:fs/promises');
            return WebAssembly.compile(await readFile(source));
        }
        source = await fetch(source);
    }
    if (!source.ok) throw new Error(`${source.url}: ${source.status} ${source.statusText}`);
    // Not by streaming, which needs a server that knows the media type.
    return WebAssembly.compile(await source.arrayBuffer());
}

/** Decodes a stream that is pushed into it. Each decoder has a memory of its own, which goes with it. */
export class Decoder {
    /** Set by `load`. */
    static module;

    #wasm;
    #handle;
    #scratch;
    #input;
    #inputSize = 0;

    constructor(limits = {}) {
        if (!Decoder.module) throw new Error('await load() before the first Decoder');
        this.#wasm = new WebAssembly.Instance(Decoder.module).exports;
        const version = this.#wasm.dapple_abi_version();
        if (version !== ABI_VERSION) throw new Error(`dapple.wasm is of version ${version}, dapple.js of ${ABI_VERSION}`);
        this.#scratch = this.#allocate(SCRATCH);
        this.#wasm.dapple_limits_default(this.#scratch);
        const view = this.#view();
        for (const [name, value] of Object.entries(limits)) {
            if (name === 'state_bytes') view.setBigUint64(this.#scratch, BigInt(value), true);
            else if (LIMITS[name]) view.setUint32(this.#scratch + LIMITS[name], value, true);
            else throw new TypeError(`${name} is no limit`);
        }
        this.#handle = this.#wasm.dapple_decoder_new(this.#scratch);
        if (!this.#handle) throw new RangeError('no memory for a decoder');
    }

    #allocate(size) {
        const memory = this.#wasm.dapple_wasm_allocate(size);
        if (!memory) throw new RangeError(`no memory for ${size} bytes`);
        return memory;
    }

    /** Made anew for each call: memory that grew has another buffer. */
    #view() {
        return new DataView(this.#wasm.memory.buffer);
    }

    #text(pointer, size) {
        return new TextDecoder().decode(new Uint8Array(this.#wasm.memory.buffer, pointer, size));
    }

    /** Throws the error of a status below 0. */
    #check(status) {
        if (status >= 0) return status;
        this.#wasm.dapple_decoder_error(this.#handle, this.#scratch);
        const view = this.#view();
        const u32 = (at) => view.getUint32(this.#scratch + at, true);
        const u64 = (at) => Number(view.getBigUint64(this.#scratch + at, true));
        if (u32(0) !== -status) throw new DappleError(`E${-status}`, { id: -status, layer: 'interface', class: 'Usage' });
        const details = { id: -status, layer: LAYERS[u32(4)], class: CLASSES[u32(8)], offset: u64(16) };
        if (u32(12)) Object.assign(details, { limit: LIMIT_NAMES[u32(12)], asked: u64(24), allowed: u64(32) });
        if (u32(48)) details.found = u64(40);
        if (u32(56)) details.track = u32(52);
        const size = this.#wasm.dapple_decoder_error_message(this.#handle, this.#scratch, SCRATCH);
        throw new DappleError(this.#text(this.#scratch, Math.min(size, SCRATCH - 1)), details);
    }

    /**
     * Feeds bytes, and gives each event when the state is that of the event: iterate to the end, or bytes are left out.
     * Throws a `DappleError`, after which the last frame stays and `resume` or `reset` go on.
     */
    *push(bytes) {
        bytes = asBytes(bytes);
        for (let at = 0; at < bytes.length; at += PIECE) {
            const piece = bytes.subarray(at, at + PIECE);
            if (this.#inputSize < piece.length) {
                if (this.#input) this.#wasm.dapple_wasm_free(this.#input, this.#inputSize);
                this.#inputSize = 0;
                this.#input = this.#allocate(piece.length);
                this.#inputSize = piece.length;
            }
            new Uint8Array(this.#wasm.memory.buffer, this.#input, piece.length).set(piece);
            let used = 0;
            while (used < piece.length) {
                const { status, consumed } = this.#step(used, piece.length - used);
                used += consumed;
                if (status > 0) yield this.#event(status);
            }
        }
    }

    #step(from, size) {
        const [usedAt, eventAt] = [this.#scratch, this.#scratch + 8];
        const status = this.#wasm.dapple_decoder_push(this.#handle, this.#input + from, size, usedAt, eventAt);
        const consumed = this.#view().getUint32(usedAt, true);
        this.#check(status);
        return { status, consumed };
    }

    #event(status) {
        const view = this.#view();
        const at = this.#scratch + 8;
        const u32 = (offset) => view.getUint32(at + offset, true);
        const kind = EVENTS[status];
        switch (kind) {
            case 'stream':
                return { kind, ticks: u32(32), seconds: u32(36) };
            case 'group':
                return { kind, group: u32(4), digest: u32(16) ? hex(view.getBigUint64(at + 8, true)) : null };
            case 'tracks':
                return { kind, added: u32(20) };
            case 'frame': {
                const items = {};
                for (let model = 1; model < MODELS.length; model++) items[MODELS[model]] = u32(40 + 16 + 4 * model);
                const tick = view.getBigUint64(at + 40, true);
                return { kind, number: u32(48), tick, transforms: u32(52), items };
            }
            case 'skipped':
                return { kind, recordType: u32(24), storedBytes: u32(28) };
            default:
                return { kind };
        }
    }

    /** Ends the input; of a `live` stream, which may stop after any frame. Throws where the stream is not complete. */
    finish({ live = false } = {}) {
        this.#check(this.#wasm[live ? 'dapple_decoder_finish_live' : 'dapple_decoder_finish'](this.#handle));
    }

    /** After an error: goes on at the next group. False where only `reset` helps. Push from `position` on. */
    resume() {
        return this.#check(this.#wasm.dapple_decoder_resume(this.#handle)) === 1;
    }

    /** Forgets the stream and its state. */
    reset() {
        this.#check(this.#wasm.dapple_decoder_reset(this.#handle));
    }

    /** Bytes of the stream used so far. */
    get position() {
        return Number(this.#wasm.dapple_decoder_position(this.#handle));
    }

    /** Digest of the state, 16 hexadecimal digits: the same from every decoder. */
    digest() {
        this.#check(this.#wasm.dapple_decoder_state_digest(this.#handle, this.#scratch));
        return hex(this.#view().getBigUint64(this.#scratch, true));
    }

    /** Bytes of memory that the decoder has. */
    get memoryBytes() {
        return this.#wasm.memory.buffer.byteLength;
    }

    /** Tracks, ids ascending. */
    tracks() {
        const count = this.#wasm.dapple_decoder_track_count(this.#handle);
        return Array.from({ length: count }, (_, index) => {
            this.#check(this.#wasm.dapple_decoder_track(this.#handle, index, this.#scratch));
            return this.#track();
        });
    }

    #track() {
        const view = this.#view();
        const start = this.#scratch;
        const u32 = (at) => view.getUint32(start + at, true);
        const u32s = (at, count) => Array.from({ length: count }, (_, i) => u32(at + 4 * i));
        const f32 = (at) => view.getFloat32(start + at, true);
        const floats = (at, count) => Float32Array.from({ length: count }, (_, i) => f32(at + 4 * i));
        const model = MODELS[u32(20)];
        return {
            id: u32(16),
            model,
            coding: u32(24),
            space: u32(28) ? 'rest' : 'mesh',
            applicationId: view.getBigUint64(start, true),
            contentHash: u32(32) ? hex(view.getBigUint64(start + 8, true)) : null,
            aabbMin: floats(40, 3),
            aabbMax: floats(52, 3),
            worldFromGrid: u32(36) ? floats(64, 12) : null,
            path: this.#text(u32(PATH), u32(PATH + 4)),
            parameters: parameters(model, 112, { u32, u32s, f32, floats, i32: (at) => view.getInt32(start + at, true) }),
        };
    }

    /** What changed since `clearDirty`, in every array of every model: elements `start` to `end`, excluded. */
    dirty() {
        const [pointerAt, countAt] = [this.#scratch, this.#scratch + 4];
        this.#check(this.#wasm.dapple_decoder_dirty(this.#handle, pointerAt, countAt));
        const view = this.#view();
        const start = view.getUint32(pointerAt, true);
        return Array.from({ length: view.getUint32(countAt, true) }, (_, i) => {
            const u32 = (at) => view.getUint32(start + 16 * i + at, true);
            return { buffer: u32(0), track: u32(4), start: u32(8), end: u32(12) };
        });
    }

    /** The dirty ranges have been uploaded. */
    clearDirty() {
        this.#check(this.#wasm.dapple_decoder_clear_dirty(this.#handle));
    }

    /**
     * An array of the decoder's memory, not a copy. It holds until the next `push`, `reset` or `resume`: memory may grow
     * then, which detaches it. `track` is not looked at for an array of all tracks.
     */
    array(buffer, track = 0) {
        this.#check(this.#wasm.dapple_decoder_array(this.#handle, buffer, track, this.#scratch));
        const view = this.#view();
        const View = VIEWS[buffer];
        const [data, size] = [view.getUint32(this.#scratch, true), view.getUint32(this.#scratch + 4, true)];
        return size === 0 ? new View(0) : new View(view.buffer, data, size / View.BYTES_PER_ELEMENT);
    }

    /** Bytes of an element of an array. */
    elementBytes(buffer, track = 0) {
        this.#check(this.#wasm.dapple_decoder_array(this.#handle, buffer, track, this.#scratch));
        return this.#view().getUint32(this.#scratch + 8, true);
    }

    /** The probes of a track as they are coded: 28 numbers each, the level and 27 codes. A copy. */
    probes(track, count) {
        const size = 56 * count;
        const memory = this.#allocate(size);
        try {
            this.#check(this.#wasm.dapple_decoder_probes(this.#handle, track, 0, count, memory));
            return new Int16Array(this.#wasm.memory.buffer.slice(memory, memory + size));
        } finally {
            this.#wasm.dapple_wasm_free(memory, size);
        }
    }

    /**
     * Brings what changed to WebGPU buffers, and clears the dirty ranges. `buffers` is a `Map` that this fills: keys as
     * of `bufferKey`. Returns the keys of the buffers that are new or have another size, for new bind groups.
     */
    upload(device, buffers, usage = 0x80 | 0x20 | 0x08 /* STORAGE | VERTEX | COPY_DST */) {
        const replaced = new Set();
        for (const { buffer, track, start, end } of this.dirty()) {
            const key = bufferKey(buffer, track);
            const array = this.array(buffer, track);
            const bytes = new Uint8Array(array.buffer, array.byteOffset, array.byteLength);
            // Buffers, offsets and sizes are multiples of 4 bytes.
            const size = Math.max((bytes.length + 3) & ~3, 4);
            let of = buffers.get(key);
            let [from, to] = [start, end].map((element) => element * this.elementBytes(buffer, track));
            if (of?.size !== size) {
                of?.destroy();
                of = device.createBuffer({ label: `dapple ${key}`, size, usage });
                buffers.set(key, of);
                replaced.add(key);
                [from, to] = [0, bytes.length];
            }
            from &= ~3;
            to = (to + 3) & ~3;
            const whole = Math.min(to, bytes.length & ~3);
            if (whole > from) device.queue.writeBuffer(of, from, bytes, from, whole - from);
            if (to > whole && bytes.length > whole) {
                const rest = new Uint8Array(4);
                rest.set(bytes.subarray(whole));
                device.queue.writeBuffer(of, whole, rest);
            }
        }
        const live = new Set(this.tracks().map(({ id }) => id));
        for (const [key, of] of buffers) {
            const [buffer, track] = key.split(':').map(Number);
            if (SHARED.has(buffer) || live.has(track)) continue;
            of.destroy();
            buffers.delete(key);
        }
        this.clearDirty();
        return replaced;
    }
}

/** The key of an array in the map of `Decoder.upload`. */
export function bufferKey(buffer, track = 0) {
    return `${buffer}:${SHARED.has(buffer) ? 0 : track}`;
}

/**
 * Decodes a stream of any kind: bytes, a `Response`, a `ReadableStream`, or chunks of an async iterable. Each event has
 * the decoder, whose state is that of the event.
 */
export async function* decode(stream, decoder, { live = false } = {}) {
    await load();
    decoder ??= new Decoder();
    for await (const chunk of chunks(stream)) {
        for (const event of decoder.push(chunk)) yield Object.assign(event, { decoder });
    }
    decoder.finish({ live });
}

/** The bytes of an array buffer or of a view of any kind. */
function asBytes(bytes) {
    if (bytes instanceof Uint8Array) return bytes;
    if (ArrayBuffer.isView(bytes)) return new Uint8Array(bytes.buffer, bytes.byteOffset, bytes.byteLength);
    if (bytes instanceof ArrayBuffer) return new Uint8Array(bytes);
    throw new TypeError('a stream is bytes: an ArrayBuffer or a view of one');
}

async function* chunks(stream) {
    if (stream instanceof ArrayBuffer || ArrayBuffer.isView(stream)) {
        yield stream;
        return;
    }
    if (stream instanceof Response) {
        if (!stream.ok) throw new Error(`${stream.url}: ${stream.status} ${stream.statusText}`);
        stream = stream.body ?? [];
    }
    if (stream instanceof Blob) stream = stream.stream();
    if (typeof stream !== 'object' || !(stream?.[Symbol.asyncIterator] || stream?.[Symbol.iterator] || stream?.getReader)) {
        throw new TypeError('decode takes bytes, a Response, a Blob, a ReadableStream or chunks of bytes');
    }
    if (!(stream instanceof ReadableStream)) {
        yield* stream;
        return;
    }
    // Not every browser iterates over a ReadableStream.
    const reader = stream.getReader();
    try {
        for (;;) {
            const { done, value } = await reader.read();
            if (done) return;
            yield value;
        }
    } finally {
        reader.cancel().catch(() => {});
    }
}

/** Whether bytes are a whole stream: `{ valid: true, frames, digest }`, or `{ valid: false, error }`. */
export async function validate(bytes, limits) {
    await load();
    const decoder = new Decoder(limits);
    let frames = 0;
    try {
        for (const event of decoder.push(bytes)) frames += event.kind === 'frame';
        decoder.finish();
        return { valid: true, frames, digest: decoder.digest() };
    } catch (error) {
        if (!(error instanceof DappleError)) throw error;
        return { valid: false, frames, error };
    }
}

function hex(number) {
    return number.toString(16).padStart(16, '0');
}

function parameters(model, at, { u32, u32s, i32, f32, floats }) {
    const signals = () => ({ count: u32(at), kinds: u32s(at + 4, 2), distances: floats(at + 12, 2), share: f32(at + 20) });
    switch (model) {
        case 'points':
            return {
                gridFromMesh: floats(at, 12),
                dims: u32s(at + 48, 3),
                cellEdge: f32(at + 60),
                radius: f32(at + 64),
                positionBits: u32(at + 68),
                normalBits: u32(at + 72),
                aoBits: u32(at + 76),
                bucketCount: u32(at + 80),
                cellCapacity: u32(at + 84),
                firstBucket: u32(at + 88),
                firstCell: u32(at + 92),
            };
        case 'probes':
            return {
                gridFromMesh: floats(at, 12),
                dims: u32s(at + 48, 3),
                spacing: floats(at + 60, 3),
                exponent: i32(at + 72),
                visibilitySide: u32(at + 76),
                visibilityRange: f32(at + 80),
                lumaSteps: u32s(at + 84, 3),
                chromaSteps: u32s(at + 96, 3),
                visibilitySteps: [u32(at + 108) & 0xffff, u32(at + 108) >>> 16],
            };
        case 'vertices':
            return {
                signals: signals(),
                count: u32(at + 24),
                bits: u32(at + 28),
                order: u32(at + 32),
                firstValue: u32(at + 36),
            };
        case 'instances':
            return { signals: signals(), count: u32(at + 24), exponent: u32(at + 28), step: u32(at + 32) };
        default:
            return {
                signals: signals(),
                count: u32(at + 24),
                capacity: u32(at + 28),
                exponent: u32(at + 32),
                step: u32(at + 36),
            };
    }
}
