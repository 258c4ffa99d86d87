// Pictures through extractor_core, each after a reset. DESCRIPTOR_BYTES stands in block.h.
//
// Input on stdin: seven 32-bit words (width, height, threshold, policy, target, angle bits, and the threshold to begin with), then the pixels,
// 16 bits each. Output on stdout: letters with what follows them; clock 0 is the first after reset:
//   P x y clk   from which clock on are the pixels from column x of row y offered, each not before the one before it? Answered by as many clocks.
//   R clk       when is the record taken that stands since clk? Answered by a clock.
//   O clk x y score angle octave descriptor   it is taken.
//   E clocks and counts, as the end of main() writes them.
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <vector>

#include "Vblock.h"
#include "block.h"
#include "verilated.h"

struct Picture {
    uint32_t width, height, threshold, policy, target, angle_bits, first_threshold;
};

// Clocks without a record after which none is on its way: an engine's 256 tests and a cell row's walk take far less.
static const uint32_t quiet_clk = 30000;

static void put(uint64_t value, size_t bytes) { fwrite(&value, bytes, 1, stdout); }

static bool answered(void* to, size_t clocks) {
    fflush(stdout);
    return fread(to, 8, clocks, stdin) == clocks;
}

static void edge(Vblock& block) {
    block.clk = 1;
    block.eval();
    block.clk = 0;
}

int main() {
    VerilatedContext context;
    context.randReset(2);  // Registers wake up with random values: reset alone must settle them.
    context.randSeed(7);
    Vblock block{&context};
    block.clk = 0;
    Picture picture;
    while (fread(&picture, sizeof picture, 1, stdin) == 1) {
        const size_t count = size_t(picture.width) * picture.height;
        std::vector<uint16_t> pixels(count);
        if (fread(pixels.data(), 2, count, stdin) != count) return 1;
        block.width = picture.width;
        block.height = picture.height;
        block.policy = picture.policy;
        block.target = picture.target;
        block.angle_bits = picture.angle_bits;
        block.in_valid = block.out_ready = 0;
        // An adaptive threshold begins where the port stands in reset, and falls no lower than where it stands later.
        block.threshold = picture.first_threshold;
        block.rst = 1;
        block.eval();
        edge(block);
        block.rst = 0;
        block.threshold = picture.threshold;

        std::vector<uint64_t> offered(picture.width);
        size_t next = 0, known = 0;
        uint64_t taken = 0, end_clk = 0;
        uint32_t not_ready = 0;
        bool stands = false, ended = false;
        for (uint64_t clk = 0, quiet = 0; quiet < quiet_clk; clk++, quiet++) {
            const size_t x = next % picture.width;
            if (next < count && known <= next) {
                putchar('P');
                put(x, 4);
                put(next / picture.width, 4);
                put(clk, 8);
                if (!answered(&offered[x], picture.width - x)) return 1;
                known = next - x + picture.width;
            }
            block.in_valid = next < count && clk >= offered[x];
            block.in_pixel = block.in_valid ? pixels[next] : 0;
            block.out_ready = 0;
            block.eval();
            if (block.out_valid && !stands) {
                putchar('R');
                put(clk, 8);
                if (!answered(&taken, 1)) return 1;
                stands = true;
            }
            if (stands || !ended) quiet = 0;
            if (stands && clk >= taken) {
                block.out_ready = 1;
                block.eval();
                putchar('O');
                put(clk, 8);
                put(block.out_x_q4, 2);
                put(block.out_y_q4, 2);
                put(block.out_score, 2);
                put(block.out_angle, 1);
                put(block.out_octave, 1);
                fwrite(&block.out_descriptor, 1, DESCRIPTOR_BYTES, stdout);
                stands = false;
            }
            if (block.in_ready && next == count && !ended) {
                ended = true;
                end_clk = clk;
                not_ready = block.n_not_ready;
            }
            if (block.in_ready && block.in_valid) {
                // Taken later than it was offered: so are those after it.
                if (clk != offered[x]) known = next + 1;
                next++;
            }
            edge(block);
        }
        putchar('E');
        put(end_clk, 8);
        for (uint32_t value : {uint32_t(block.n_corners), uint32_t(block.n_without_patch), uint32_t(block.n_unselected), uint32_t(block.n_dropped),
                               uint32_t(block.n_late), uint32_t(block.n_stalled), not_ready, uint32_t(block.threshold_now)})
            put(value, 4);
        fflush(stdout);
    }
    return 0;
}
