// Plays one frame to the extractor's front and times it. Inputs: a file of 32-bit words: width, height, threshold, clocks, then the pixels; a
// pixel stands in every clock and every row may start. Output on stdout: the nanoseconds of the run and, where the second argument is 1,
// the hash of every pin of every clock.
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <vector>

#include "Vblock.h"
#include "block.h"
#include "verilated.h"

// FNV-1a over 64-bit words.
static inline void mix(uint64_t& hash, uint64_t value) { hash = (hash ^ value) * 0x100000001B3ull; }

template <bool CAPTURE>
static uint64_t run(const uint32_t* settings, const std::vector<uint32_t>& pixels) {
    VerilatedContext context;
    Vblock block{&context};
    block.width = settings[0];
    block.height = settings[1];
    block.threshold = settings[2];
    block.in_valid = 1;
    block.row_ok = 1;
    block.clk = 0;
    block.rst = 1;
    block.eval();
    block.clk = 1;
    block.eval();
    block.clk = 0;
    block.rst = 0;
    block.eval();
    uint64_t hash = 0xCBF29CE484222325ull;
    size_t next = 0;
    for (uint32_t clock = 0; clock < settings[3]; clock++) {
        block.in_pixel = next < pixels.size() ? pixels[next] : 0;
        next += block.in_ready;
        block.clk = 1;
        block.eval();
        if (CAPTURE) {
#define PIN(name) mix(hash, block.name);
            OUTPUTS
#undef PIN
            for (int word = 0; word < 3; word++) mix(hash, block.corner_resp[word]);
        }
        block.clk = 0;
        block.eval();
    }
    return hash;
}

int main(int, char** arguments) {
    FILE* file = fopen(arguments[1], "rb");
    std::vector<uint32_t> all;
    uint32_t word;
    if (!file) return 1;
    while (fread(&word, sizeof word, 1, file) == 1) all.push_back(word);
    fclose(file);
    const std::vector<uint32_t> pixels(all.begin() + 4, all.end());
    const bool capture = arguments[2][0] == '1';
    const auto start = std::chrono::steady_clock::now();
    const uint64_t hash = capture ? run<true>(all.data(), pixels) : run<false>(all.data(), pixels);
    const auto end = std::chrono::steady_clock::now();
    const long long taken = std::chrono::duration_cast<std::chrono::nanoseconds>(end - start).count();
    printf("%lld %016llx\n", taken, (unsigned long long)hash);
    return 0;
}
