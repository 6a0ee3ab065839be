/** Arrays of decoded state. */
export declare const Buffer: {
    /** Hash buckets of all tracks of points: 8 words each. */
    readonly PointsBuckets: 0;
    /** Cells of all tracks of points: key and 7 points. */
    readonly PointsCells: 1;
    /** Texels of a track of probes: 4 half floats each, seven planes of one texel a probe. */
    readonly ProbesTexels: 2;
    /** Visibility of a track of probes. */
    readonly ProbesVisibility: 3;
    /** Values of all tracks of vertices. */
    readonly VerticesValues: 4;
    readonly InstancesKeys: 5;
    /** 4 numbers each. */
    readonly InstancesValues: 6;
    /** 12 words each: floats, but for words 3 and 7. */
    readonly Regions: 7;
    /** 2 numbers each. */
    readonly RegionsPairs: 8;
    /** 12 floats, or none. */
    readonly Transforms: 9;
};
export type Buffer = 0 | 1 | 2 | 3 | 4 | 5 | 6 | 7 | 8 | 9;

export type Model = 'points' | 'probes' | 'vertices' | 'instances' | 'regions';

/** Upper bounds that every length in a stream is compared with before memory is reserved for it. */
export interface Limits {
    state_bytes?: number | bigint;
    stored_bytes?: number;
    unpacked_bytes?: number;
    frame_bytes?: number;
    zstd_window_bytes?: number;
    tracks?: number;
    path_bytes?: number;
    work_per_byte?: number;
}

/** An error of a stream, or of the use of a decoder. Its message is a sentence. */
export declare class DappleError extends Error {
    /** Stable number (`spec/README.md`). */
    id: number;
    layer: 'framing' | 'record' | 'codec' | 'session' | 'interface';
    class:
        | 'Malformed'
        | 'Truncated'
        | 'Unsupported'
        | 'Checksum'
        | 'LimitExceeded'
        | 'MissingBase'
        | 'Usage'
        | 'OutOfMemory';
    /** Byte of the stream. */
    offset?: number;
    /** The limit that is exceeded, what the stream asks for, and what is allowed. */
    limit?: keyof Limits;
    asked?: number;
    allowed?: number;
    found?: number;
    track?: number;
}

export type Event =
    | { kind: 'stream'; ticks: number; seconds: number }
    | { kind: 'group'; group: number; digest: string | null }
    | { kind: 'tracks'; added: number }
    | { kind: 'frame'; number: number; tick: bigint; transforms: number; items: Record<Model, number> }
    | { kind: 'skipped'; recordType: number; storedBytes: number }
    | { kind: 'end' };

export interface Signals {
    count: number;
    kinds: number[];
    distances: Float32Array;
    share: number;
}

export interface TrackBase {
    id: number;
    coding: number;
    space: 'mesh' | 'rest';
    applicationId: bigint;
    contentHash: string | null;
    aabbMin: Float32Array;
    aabbMax: Float32Array;
    /** Rows of a 3x4 matrix. */
    worldFromGrid: Float32Array | null;
    path: string;
}
export type Track = TrackBase &
    (
        | {
              model: 'points';
              parameters: {
                  gridFromMesh: Float32Array;
                  dims: number[];
                  cellEdge: number;
                  radius: number;
                  positionBits: number;
                  normalBits: number;
                  aoBits: number;
                  bucketCount: number;
                  cellCapacity: number;
                  firstBucket: number;
                  firstCell: number;
              };
          }
        | {
              model: 'probes';
              parameters: {
                  gridFromMesh: Float32Array;
                  dims: number[];
                  spacing: Float32Array;
                  exponent: number;
                  visibilitySide: number;
                  visibilityRange: number;
                  lumaSteps: number[];
                  chromaSteps: number[];
                  visibilitySteps: number[];
              };
          }
        | {
              model: 'vertices';
              parameters: { signals: Signals; count: number; bits: number; order: number; firstValue: number };
          }
        | { model: 'instances'; parameters: { signals: Signals; count: number; exponent: number; step: number } }
        | {
              model: 'regions';
              parameters: { signals: Signals; count: number; capacity: number; exponent: number; step: number };
          }
    );

/** Elements `start` to `end` (excluded) of an array that changed. */
export interface DirtyRange {
    buffer: Buffer;
    /** 0 for an array of all tracks. */
    track: number;
    start: number;
    end: number;
}

/** What `upload` needs of a `GPUBuffer`. */
export interface DeviceBuffer {
    readonly size: number;
    destroy(): void;
}

/** What `upload` needs of a `GPUDevice`. */
export interface Device<B> {
    createBuffer(descriptor: { label?: string; size: number; usage: number }): B;
    readonly queue: {
        writeBuffer(buffer: B, offset: number, data: Uint8Array<ArrayBuffer>, from?: number, size?: number): void;
    };
}

export type ArrayView = Uint32Array | Uint16Array | Uint8Array | BigUint64Array | Int16Array | Float32Array;

/** Loads the module, once. Without a source it is `dapple.wasm` beside this file. */
export declare function load(
    source?: string | URL | Response | BufferSource | WebAssembly.Module,
): Promise<WebAssembly.Module>;

/** Decodes a stream that is pushed into it. `await load()` comes first. */
export declare class Decoder {
    constructor(limits?: Limits);
    /**
     * Feeds bytes, and gives each event when the state is that of the event. Iterate to the end, or bytes are left out.
     * Throws a `DappleError`, after which the last frame stays and `resume` or `reset` go on.
     */
    push(bytes: Uint8Array | ArrayBuffer): Generator<Event, void>;
    /** Throws where the stream is not complete; a `live` one may stop after any frame. */
    finish(options?: { live?: boolean }): void;
    /** False where only `reset` helps. Push from `position` on. */
    resume(): boolean;
    reset(): void;
    get position(): number;
    /** 16 hexadecimal digits: the same from every decoder. */
    digest(): string;
    get memoryBytes(): number;
    tracks(): Track[];
    /** What changed since `clearDirty`, in every array of every model. */
    dirty(): DirtyRange[];
    clearDirty(): void;
    /** A view of the decoder's memory, not a copy. It holds until the next `push`, `reset` or `resume`. */
    array(buffer: Buffer, track?: number): ArrayView;
    elementBytes(buffer: Buffer, track?: number): number;
    /** A copy: 28 numbers a probe, the level and 27 codes. */
    probes(track: number, count: number): Int16Array;
    /**
     * Brings what changed to WebGPU buffers, and clears the dirty ranges. Returns the keys (`bufferKey`) of buffers that
     * are new or have another size. Buffers of tracks that have ended are destroyed and taken out of the map.
     */
    upload<B extends DeviceBuffer>(device: Device<B>, buffers: Map<string, B>, usage?: number): Set<string>;
}

/** The key of an array in the map of `Decoder.upload`. */
export declare function bufferKey(buffer: Buffer, track?: number): string;

/** Decodes a stream of any kind. The state of an event's decoder is that of the event. */
export declare function decode(
    stream: BufferSource | Response | Blob | ReadableStream<Uint8Array> | AsyncIterable<Uint8Array> | Iterable<Uint8Array>,
    decoder?: Decoder,
    options?: { live?: boolean },
): AsyncGenerator<Event & { decoder: Decoder }, void>;

/** Whether bytes are a whole stream. */
export declare function validate(
    bytes: Uint8Array | ArrayBuffer,
    limits?: Limits,
): Promise<
    { valid: true; frames: number; digest: string } | { valid: false; frames: number; error: DappleError }
>;
