// Plays pins to one Verilog block, clock by clock. Input on stdin: batches of a 32-bit count and then as many records of the input pins, each
// pin in whole bytes, least significant first. Output on stdout: one record of the output pins after each rising edge.
// block.h is written by the test: INPUTS and OUTPUTS list the ports as PIN(name, bytes).
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <vector>

#include "Vblock.h"
#include "block.h"
#include "verilated.h"

#define PIN(name, bytes) +bytes
static const size_t in_bytes = 0 INPUTS;
static const size_t out_bytes = 0 OUTPUTS;
#undef PIN

int main() {
    VerilatedContext context;
    context.randReset(2);  // Registers wake up with random values: reset alone must settle them.
    context.randSeed(7);
    Vblock block{&context};
    std::vector<uint8_t> in, out;
    uint32_t clocks;
    block.clk = 0;
    while (fread(&clocks, sizeof clocks, 1, stdin) == 1) {
        in.resize(clocks * in_bytes);
        out.resize(clocks * out_bytes);
        if (fread(in.data(), in_bytes, clocks, stdin) != clocks) return 1;
        const uint8_t* from = in.data();
        uint8_t* to = out.data();
        for (uint32_t clock = 0; clock < clocks; clock++) {
#define PIN(name, bytes) memcpy(&block.name, from, bytes); from += bytes;
            INPUTS
#undef PIN
            block.eval();
            block.clk = 1;
            block.eval();
#define PIN(name, bytes) memcpy(to, &block.name, bytes); to += bytes;
            OUTPUTS
#undef PIN
            block.clk = 0;
        }
        if (fwrite(out.data(), out_bytes, clocks, stdout) != clocks) return 1;
        fflush(stdout);
    }
    return 0;
}
