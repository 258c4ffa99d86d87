// Rows of conversions through sensor_core, one after the other. COLUMNS, in block.h, is its parameter.
//
// Input on stdin, for each row: six 32-bit words (columns, steps of the reset ramp, steps of the signal ramp, black level, bits, and flags:
// 1 latch, 2 Gray), then of each column the first step of the reset ramp at which its comparator is high, if there are steps, then the
// same of the signal ramp. Output on stdout: each column's code, 16 bits, as it stands on the pins in the clock of `latch`.
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <numeric>
#include <vector>

#include "Vblock.h"
#include "block.h"
#include "verilated.h"

// Comparators of one ramp: their columns in the order in which they rise.
struct Ramp {
    std::vector<uint32_t> crossing, order;

    bool read(uint32_t columns) {
        crossing.resize(columns);
        order.resize(columns);
        std::iota(order.begin(), order.end(), 0);
        if (fread(crossing.data(), 4, columns, stdin) != columns) return false;
        std::sort(order.begin(), order.end(), [this](uint32_t a, uint32_t b) { return crossing[a] < crossing[b]; });
        return true;
    }
};

struct Row {
    uint32_t columns, reset_steps, signal_steps, black, bits, flags;
};

static const uint32_t settle_clk = 2;

static void configure(Vblock& block, const Row& row) {
    block.stall = 0;
    block.enable = 1;
    block.global_shutter = 0;
    block.hts = 2 * settle_clk + row.reset_steps + row.signal_steps + 16;
    block.vts = 2;
    block.rows = 1;
    block.first_row = 0;
    block.row_step = 1;
    block.exposure_lines = 1;
    block.n_settle_reset = settle_clk;
    block.n_ramp_reset = row.reset_steps;
    block.n_settle_signal = settle_clk;
    block.n_ramp_signal = row.signal_steps;
    block.latch_mode = row.flags & 1;
    block.gray = row.flags >> 1 & 1;
    block.black = row.black;
    block.bits = row.bits;
    block.lanes = 1;
    block.columns = row.columns;
}

static void edge(Vblock& block) {
    block.eval();
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
    Row row;
    Ramp reset, signal;
    std::vector<uint8_t> comparators((COLUMNS + 7) / 8);
    while (fread(&row, sizeof row, 1, stdin) == 1) {
        if (row.columns > COLUMNS || (row.reset_steps > 0 && !reset.read(row.columns)) || !signal.read(row.columns)) return 1;
        configure(block, row);
        block.rst = 1;
        edge(block);
        block.rst = 0;
        uint32_t step = 0, risen = 0;
        // The line before the first is the shutter's.
        uint64_t left_clk = 4 * uint64_t(block.hts);
        while (!block.latch) {
            const Ramp& ramp = block.ramp_down ? reset : signal;
            if (block.ramp_step) {
                step++;
                for (; risen < row.columns && ramp.crossing[ramp.order[risen]] <= step; risen++)
                    comparators[ramp.order[risen] / 8] |= 1 << ramp.order[risen] % 8;
            } else if (block.ramp_running) {
                step = risen = 0;
                std::fill(comparators.begin(), comparators.end(), 0);
            }
            memcpy(&block.comparators, comparators.data(), comparators.size());
            edge(block);
            if (left_clk-- == 0) return 2;
        }
        if (fwrite(&block.codes, 2, row.columns, stdout) != row.columns) return 1;
        fflush(stdout);
    }
    return 0;
}
