// FAST-9/16: the greatest, over the 16 arcs of nine pixels, of the least difference to the centre, all brighter or all darker; 0 if none.
//
// Eight runs of eight pixels from the odd pixels of the circle, each with either of the two pixels beside it, are all sixteen arcs. A network of minima and maxima
// without branches, three enabled clocks from the window to `difference`. `whole` (the 7x7 pixels are there) belongs to the slot whose difference comes next.
module fx_fast #(
    parameter PIX_BITS = 8
) (
    input  logic                   clk,
    input  logic                   en,
    input  logic [16*PIX_BITS-1:0] circle,
    input  logic [   PIX_BITS-1:0] centre,
    input  logic                   whole,
    output logic [   PIX_BITS-1:0] difference
);
  localparam P = PIX_BITS;

  function automatic [P-1:0] lower(input logic [P-1:0] a, input logic [P-1:0] b);
    lower = a < b ? a : b;
  endfunction
  function automatic [P-1:0] higher(input logic [P-1:0] a, input logic [P-1:0] b);
    higher = a < b ? b : a;
  endfunction

  // Least of an arc's nine pixels (brighter arcs) and greatest (darker arcs), for pairs of arcs that share eight.
  logic [8*P-1:0] low_2, high_2, low_4, high_4, least, greatest;
  genvar k;
  generate
    for (k = 0; k < 8; k = k + 1) begin : pair_of_arcs
      localparam ODD = 2 * k + 1, EVEN = (2 * k + 2) % 16, BEFORE = 2 * k, AFTER = (2 * k + 9) % 16;
      localparam NEXT = (k + 1) % 8, SECOND = (k + 2) % 8;
      logic [P-1:0] low_8, high_8;
      assign low_2[k*P+:P]  = lower(circle[ODD*P+:P], circle[EVEN*P+:P]);
      assign high_2[k*P+:P] = higher(circle[ODD*P+:P], circle[EVEN*P+:P]);
      assign low_4[k*P+:P]  = lower(low_2[k*P+:P], low_2[NEXT*P+:P]);
      assign high_4[k*P+:P] = higher(high_2[k*P+:P], high_2[NEXT*P+:P]);
      assign low_8  = lower(low_4[k*P+:P], low_4[SECOND*P+:P]);
      assign high_8 = higher(high_4[k*P+:P], high_4[SECOND*P+:P]);
      always_ff @(posedge clk) begin
        if (en) begin
          least[k*P+:P]    <= lower(low_8, higher(circle[BEFORE*P+:P], circle[AFTER*P+:P]));
          greatest[k*P+:P] <= higher(high_8, lower(circle[BEFORE*P+:P], circle[AFTER*P+:P]));
        end
      end
    end
  endgenerate

  logic [P-1:0] bright_low, bright_high, dark_low, dark_high;
  assign bright_low  = higher(higher(least[0*P+:P], least[1*P+:P]), higher(least[2*P+:P], least[3*P+:P]));
  assign bright_high = higher(higher(least[4*P+:P], least[5*P+:P]), higher(least[6*P+:P], least[7*P+:P]));
  assign dark_low    = lower(lower(greatest[0*P+:P], greatest[1*P+:P]), lower(greatest[2*P+:P], greatest[3*P+:P]));
  assign dark_high   = lower(lower(greatest[4*P+:P], greatest[5*P+:P]), lower(greatest[6*P+:P], greatest[7*P+:P]));

  logic [P-1:0] centre_1, centre_2, bright, dark, above, below;
  assign above = bright > centre_2 ? bright - centre_2 : '0;
  assign below = centre_2 > dark ? centre_2 - dark : '0;
  always_ff @(posedge clk) begin
    if (en) begin
      centre_1   <= centre;
      centre_2   <= centre_1;
      bright     <= higher(bright_low, bright_high);
      dark       <= lower(dark_low, dark_high);
      difference <= whole ? higher(above, below) : '0;
    end
  end
endmodule
