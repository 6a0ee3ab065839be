// Traces the rays of a file through the scene of the same file with Embree, and prints what it took.
//
//   embree FILE REPEATS
//
// Prints lines of words: "build LEVELS SECONDS" and
// "rays SET LEVELS THREADS SECONDS HITS", LEVELS being "two" (instances) or "flat" (one mesh).
// SECONDS of a trace is the least over the repeats of the greatest processor time of a thread, so
// that other work on the machine does not count. `trace.rs` writes the file and says what is in it.

#include <embree3/rtcore.h>
#include <pmmintrin.h>
#include <time.h>
#include <xmmintrin.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <thread>
#include <vector>

struct Mesh { std::vector<float> positions; std::vector<uint32_t> triangles; };
struct Instance { uint32_t mesh; float columns[12]; };
struct Ray { float o[3], d[3], t_max; };
struct RaySet { uint32_t closest; std::vector<Ray> rays; };

static FILE *file;
template <class T> static void read(T *to, size_t n) {
    if (fread(to, sizeof(T), n, file) != n) { fprintf(stderr, "the file is too short\n"); exit(1); }
}
static uint32_t word() { uint32_t x; read(&x, 1); return x; }

static double thread_seconds() {
    timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return t.tv_sec + 1e-9 * t.tv_nsec;
}

static void attach(RTCDevice device, RTCScene scene, const std::vector<float> &p, const std::vector<uint32_t> &t) {
    RTCGeometry g = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    memcpy(rtcSetNewGeometryBuffer(g, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12, p.size() / 3), p.data(), p.size() * 4);
    memcpy(rtcSetNewGeometryBuffer(g, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, t.size() / 3), t.data(), t.size() * 4);
    rtcCommitGeometry(g);
    rtcAttachGeometry(scene, g);
    rtcReleaseGeometry(g);
}

static void trace(RTCScene scene, const std::vector<Ray> &rays, size_t from, size_t to, bool closest, double *seconds, uint64_t *hits) {
    _MM_SET_FLUSH_ZERO_MODE(_MM_FLUSH_ZERO_ON);
    _MM_SET_DENORMALS_ZERO_MODE(_MM_DENORMALS_ZERO_ON);
    double begin = thread_seconds();
    uint64_t count = 0;
    for (size_t i = from; i < to; i++) {
        RTCIntersectContext context;
        rtcInitIntersectContext(&context);
        RTCRayHit rh{};
        RTCRay &r = rh.ray;
        r.org_x = rays[i].o[0]; r.org_y = rays[i].o[1]; r.org_z = rays[i].o[2];
        r.dir_x = rays[i].d[0]; r.dir_y = rays[i].d[1]; r.dir_z = rays[i].d[2];
        r.tnear = 0; r.tfar = rays[i].t_max; r.mask = -1;
        if (closest) {
            rh.hit.geomID = RTC_INVALID_GEOMETRY_ID;
            rtcIntersect1(scene, &context, &rh);
            count += rh.hit.geomID != RTC_INVALID_GEOMETRY_ID;
        } else {
            rtcOccluded1(scene, &context, &r);
            count += r.tfar < 0;
        }
    }
    *seconds = thread_seconds() - begin;
    *hits = count;
}

int main(int argc, char **argv) {
    if (argc != 3 || !(file = fopen(argv[1], "rb"))) { fprintf(stderr, "embree FILE REPEATS\n"); return 2; }
    int repeats = atoi(argv[2]);
    std::vector<Mesh> meshes(word());
    for (Mesh &m : meshes) {
        m.positions.resize(3 * word());
        m.triangles.resize(3 * word());
        read(m.positions.data(), m.positions.size());
        read(m.triangles.data(), m.triangles.size());
    }
    std::vector<Instance> instances(word());
    for (Instance &i : instances) { i.mesh = word(); read(i.columns, 12); }
    std::vector<RaySet> sets(word());
    for (RaySet &s : sets) { s.closest = word(); s.rays.resize(word()); read(s.rays.data(), s.rays.size()); }

    RTCDevice device = rtcNewDevice(nullptr);
    auto begin = std::chrono::steady_clock::now();
    auto elapsed = [&] { return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count(); };
    std::vector<RTCScene> parts;
    for (const Mesh &m : meshes) {
        RTCScene s = rtcNewScene(device);
        attach(device, s, m.positions, m.triangles);
        rtcCommitScene(s);
        parts.push_back(s);
    }
    RTCScene two = rtcNewScene(device);
    for (const Instance &i : instances) {
        RTCGeometry g = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_INSTANCE);
        rtcSetGeometryInstancedScene(g, parts[i.mesh]);
        rtcSetGeometryTransform(g, 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, i.columns);
        rtcCommitGeometry(g);
        rtcAttachGeometry(two, g);
        rtcReleaseGeometry(g);
    }
    rtcCommitScene(two);
    printf("build two %.6f\n", elapsed());

    std::vector<float> p;
    std::vector<uint32_t> t;
    for (const Instance &i : instances) {
        const Mesh &m = meshes[i.mesh];
        uint32_t base = p.size() / 3;
        for (size_t v = 0; v < m.positions.size(); v += 3)
            for (int k = 0; k < 3; k++)
                p.push_back(i.columns[k] * m.positions[v] + i.columns[3 + k] * m.positions[v + 1] +
                            i.columns[6 + k] * m.positions[v + 2] + i.columns[9 + k]);
        for (uint32_t x : m.triangles) t.push_back(base + x);
    }
    begin = std::chrono::steady_clock::now();
    RTCScene flat = rtcNewScene(device);
    attach(device, flat, p, t);
    rtcCommitScene(flat);
    printf("build flat %.6f\n", elapsed());

    for (size_t set = 0; set < sets.size(); set++)
        for (bool is_flat : {false, true})
            for (size_t threads : {1, 2}) {
                double best = 1e30;
                uint64_t hits = 0;
                for (int k = 0; k < repeats; k++) {
                    std::vector<double> seconds(threads);
                    std::vector<uint64_t> found(threads);
                    std::vector<std::thread> team;
                    const auto &rays = sets[set].rays;
                    for (size_t i = 0; i < threads; i++)
                        team.emplace_back(trace, is_flat ? flat : two, std::cref(rays), rays.size() * i / threads,
                                          rays.size() * (i + 1) / threads, sets[set].closest, &seconds[i], &found[i]);
                    for (auto &x : team) x.join();
                    best = std::min(best, *std::max_element(seconds.begin(), seconds.end()));
                    hits = 0;
                    for (uint64_t x : found) hits += x;
                }
                printf("rays %zu %s %zu %.6f %llu\n", set, is_flat ? "flat" : "two", threads, best, (unsigned long long)hits);
            }
}
