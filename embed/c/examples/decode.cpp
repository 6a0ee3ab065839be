// Decodes a file in C++17, with handles that free themselves, and prints tracks and bytes of each frame.
#include <cstdio>
#include <fstream>
#include <iostream>
#include <iterator>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "dapple.h"

struct Free {
    void operator()(dapple_decoder *decoder) const { dapple_decoder_free(decoder); }
};
using Decoder = std::unique_ptr<dapple_decoder, Free>;

static std::string message(const Decoder &decoder) {
    std::string text(dapple_decoder_error_message(decoder.get(), nullptr, 0), '\0');
    dapple_decoder_error_message(decoder.get(), text.data(), text.size() + 1);
    return text;
}

int main(int count, char **words) {
    std::ifstream file(count == 2 ? words[1] : "", std::ios::binary);
    if (!file) {
        std::cerr << "usage: decode FILE\n";
        return 2;
    }
    std::vector<unsigned char> bytes{std::istreambuf_iterator<char>(file), {}};
    Decoder decoder{dapple_decoder_new(nullptr)};
    for (std::size_t at = 0, used = 0; at < bytes.size(); at += used) {
        dapple_event_info event;
        int status =
            dapple_decoder_push(decoder.get(), bytes.data() + at, bytes.size() - at, &used, &event);
        if (status < 0) {
            std::cerr << message(decoder) << '\n';
            return 1;
        }
        if (status != DAPPLE_EVENT_FRAME) {
            continue;
        }
        std::cout << "frame " << event.frame.number << '\n';
        for (std::size_t i = 0; i < dapple_decoder_track_count(decoder.get()); ++i) {
            dapple_track track;
            dapple_decoder_track(decoder.get(), i, &track);
            std::size_t dirty = 0, size = 0;
            for (unsigned buffer = DAPPLE_BUFFER_POINTS_BUCKETS; buffer <= DAPPLE_BUFFER_TRANSFORMS;
                 ++buffer) {
                dapple_array array;
                dapple_decoder_array(decoder.get(), buffer, track.id, &array);
                size += array.size;
                for (std::size_t r = 0; r < array.dirty_count; ++r) {
                    dirty += array.element_size * (array.dirty[r].end - array.dirty[r].start);
                }
            }
            std::cout << "  track " << track.id << " \"" << std::string_view(track.path, track.path_size)
                      << "\" of model " << track.model << ": " << dirty << " of " << size
                      << " bytes changed\n";
        }
        dapple_decoder_clear_dirty(decoder.get());
    }
    if (dapple_decoder_finish(decoder.get()) < 0) {
        std::cerr << message(decoder) << '\n';
        return 1;
    }
}
