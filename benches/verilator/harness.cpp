// Plays one frame to one style of the core and times it. Inputs: a file with the pins of the configuration (32 bits each, in the order
// of CONFIG), the clocks to run, the columns, and one crossing a column for each ramp in the order in which ramps start. Output on
// stdout: the nanoseconds of the run and, where the second argument is 1, the hash of every pin of every clock.
//
// The comparators' bits of every step are worked out before the timer starts.
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <vector>

#include "Vblock.h"
#include "block.h"
#include "verilated.h"

// FNV-1a over 64-bit words.
static inline void mix(uint64_t& hash, uint64_t value) { hash = (hash ^ value) * 0x100000001B3ull; }

template <bool CAPTURE>
static uint64_t run(const std::vector<uint32_t>& config, uint32_t clocks, const std::vector<uint32_t>& bits, uint32_t words) {
    VerilatedContext context;
    Vblock block{&context};
    size_t index = 0;
#define PIN(name) block.name = config[index++];
    CONFIG
#undef PIN
    uint64_t hash = 0xCBF29CE484222325ull;
    const uint32_t* next = bits.data();
    block.enable = 1;
    block.stall = 0;
    block.clk = 0;
    for (uint32_t clock = 0; clock < clocks; clock++) {
        block.rst = clock == 0;
        if (block.ramp_step) {
            memcpy(&block.comparators, next, 4 * words);
            next += words;
        }
        block.clk = 1;
        block.eval();
        if (CAPTURE) {
#define PIN(name) mix(hash, block.name);
            OUTPUTS
#undef PIN
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

#define PIN(name) +1
    const size_t config_words = 0 CONFIG;
#undef PIN
    const std::vector<uint32_t> config(all.begin(), all.begin() + config_words);
    const uint32_t clocks = all[config_words], columns = all[config_words + 1], ramps = all[config_words + 2];
    const uint32_t* at = all.data() + config_words + 3;
    const uint32_t words = (columns + 31) / 32;
    std::vector<uint32_t> bits;
    for (uint32_t ramp = 0; ramp < ramps; ramp++) {
        const uint32_t steps = *at++;
        for (uint32_t step = 1; step <= steps; step++) {
            const size_t base = bits.size();
            bits.resize(base + words);
            for (uint32_t column = 0; column < columns; column++) {
                bits[base + column / 32] |= uint32_t(step >= at[column]) << (column % 32);
            }
        }
        at += columns;
    }
    const bool capture = arguments[2][0] == '1';
    const auto start = std::chrono::steady_clock::now();
    const uint64_t hash = capture ? run<true>(config, clocks, bits, words) : run<false>(config, clocks, bits, words);
    const auto end = std::chrono::steady_clock::now();
    const long long taken = std::chrono::duration_cast<std::chrono::nanoseconds>(end - start).count();
    printf("%lld %016llx\n", taken, (unsigned long long)hash);
    return 0;
}
