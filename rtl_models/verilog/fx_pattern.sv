// The descriptor's pairs of points: x1, y1, x2, y2 of pair i, each five bits, signed.
//
// With SYMMETRIC, pair 8 t + b is pair b under t / 32 of a turn. Both tables follow from the integer rule of the published pattern (docs/rtl.md); a test
// compares them with it and can write this file.
module fx_pattern #(
    parameter SYMMETRIC = 0
) (
    input  logic [ 7:0] pair,
    output logic [19:0] points
);
  // The highest pair stands first.
  localparam [256*20-1:0] DRAWN = {
    20'hca01c, 20'hef394, 20'hefb01, 20'h27e83, 20'hde42a, 20'hcfaba, 20'hd28a8, 20'h00005, 20'haf6a3, 20'h49002, 20'h0fce0, 20'hfe48c,
    20'h4ec3d, 20'hff4e9, 20'h18b20, 20'h2a879, 20'h107fe, 20'he04db, 20'h12f87, 20'hd96c0, 20'h11ca2, 20'h10eda, 20'hf0326, 20'h39bfe,
    20'hdf49f, 20'h46afc, 20'h11498, 20'hfaf97, 20'hddb45, 20'h1040b, 20'hbfff7, 20'h560a3, 20'h23140, 20'h67469, 20'hea442, 20'hc83e1,
    20'h37bbe, 20'he8f46, 20'h07fc5, 20'h08fa3, 20'h5843f, 20'h4680c, 20'h05b44, 20'hf1419, 20'h48f9d, 20'hf24c0, 20'h2877a, 20'hd189f,
    20'h483c6, 20'h5645d, 20'he08be, 20'h127fe, 20'hffb09, 20'h2ff61, 20'h0819b, 20'hdd844, 20'h51fd7, 20'h477c1, 20'hb67d4, 20'h198db,
    20'h37144, 20'h2df20, 20'h01360, 20'h56ba8, 20'h15fe5, 20'h2a498, 20'h2641c, 20'hfff7b, 20'h3133d, 20'h57f89, 20'h264c5, 20'h08cbf,
    20'hc749b, 20'h3f402, 20'h010c2, 20'h48ae3, 20'h05145, 20'hc8bfe, 20'h057de, 20'h4f846, 20'ha1776, 20'hf9b59, 20'h38022, 20'h1f35d,
    20'h267f7, 20'hb0aa6, 20'hf00a0, 20'hf041d, 20'h0fc1a, 20'h37f96, 20'he0442, 20'hfa2c7, 20'he9338, 20'h26f60, 20'h217b9, 20'h0fc88,
    20'hd56fd, 20'hf8e85, 20'h38b38, 20'h36026, 20'h56786, 20'h086e0, 20'h40459, 20'h38064, 20'h51415, 20'h40937, 20'h19b47, 20'h203e3,
    20'hfeb82, 20'hbf465, 20'hc8c1d, 20'h39856, 20'hda83c, 20'h29b9a, 20'hd03da, 20'hba3e7, 20'hf7c6c, 20'h28000, 20'hf67a4, 20'he1c0a,
    20'he0d06, 20'h4fc9b, 20'h1eef9, 20'h3fc39, 20'hb8b75, 20'he72ba, 20'hdf042, 20'hdfae3, 20'hb175e, 20'hf0bf9, 20'he137c, 20'h4f428,
    20'hcd93b, 20'h4945e, 20'h1d762, 20'haf85a, 20'h197aa, 20'h1ffa4, 20'he783c, 20'hf2782, 20'hf289d, 20'h4fbc7, 20'h07867, 20'hf585e,
    20'hf5f55, 20'h31b79, 20'h1acfd, 20'hef007, 20'hd8839, 20'h20d5f, 20'h3872a, 20'he7fc5, 20'h00425, 20'ha93c0, 20'hc06f7, 20'h49b5d,
    20'he846c, 20'hd975b, 20'hd0fd6, 20'hc2000, 20'h29038, 20'hc8bdc, 20'hde37f, 20'h493b4, 20'he0866, 20'h01c1e, 20'h270e7, 20'h0205f,
    20'he78bf, 20'h058fd, 20'h51386, 20'h0fb46, 20'h56f75, 20'h068a6, 20'he1fb7, 20'hd285a, 20'h317e9, 20'h17101, 20'h0dbe9, 20'h59082,
    20'h31442, 20'hd57e5, 20'hbed05, 20'hc6362, 20'hed520, 20'he5fc7, 20'hf8d19, 20'h4ef62, 20'hdf525, 20'h3937f, 20'h30985, 20'h20300,
    20'h00481, 20'h313f7, 20'hd0f5e, 20'hf76fb, 20'h50f20, 20'h1873e, 20'hf33de, 20'hdf787, 20'h213a4, 20'hd1097, 20'h033c3, 20'h17b89,
    20'h080e0, 20'h264ac, 20'he0922, 20'h3650a, 20'he90b9, 20'h0a358, 20'h678e0, 20'h403b5, 20'h0eb9a, 20'h15b20, 20'hc97ea, 20'h1773b,
    20'haff9b, 20'h37406, 20'hf8adb, 20'h4185e, 20'h166fb, 20'hf5485, 20'hd183c, 20'he6016, 20'hf7b25, 20'h157c3, 20'h32b5f, 20'hd1821,
    20'hea878, 20'h367e1, 20'hd6b56, 20'h170a4, 20'hfe3e8, 20'h27b20, 20'hfa563, 20'ha0bc2, 20'hf8024, 20'h390c0, 20'hdfbc6, 20'h3941d,
    20'h1ff41, 20'h08efe, 20'he139d, 20'h07760, 20'h3777c, 20'h01b5e, 20'h1f13b, 20'h30b59, 20'h1871b, 20'hcdbc1, 20'h323bd, 20'hdf01c,
    20'h1831a, 20'hf9860, 20'hee4c0, 20'h07419
  };
  localparam [256*20-1:0] TURNED = {
    20'h182fd, 20'hbe3c1, 20'h39f9e, 20'hd77fc, 20'h1fefc, 20'h0187f, 20'he68df, 20'hff7f9, 20'h182fe, 20'hb67e2, 20'h4979e, 20'hd7bdc,
    20'h1fede, 20'h0987f, 20'hdecde, 20'hff7ba, 20'h1fee0, 20'haf3e2, 20'h48f9f, 20'hd7fdd, 20'h17adf, 20'h1985e, 20'hd70bd, 20'hf7b9a,
    20'h1fee2, 20'ha7be2, 20'h50780, 20'hd07bd, 20'h17ac1, 20'h2145e, 20'hcf49c, 20'hf7b7b, 20'h17ae4, 20'ha0002, 20'h57f81, 20'hd0bbe,
    20'h17ae3, 20'h2105e, 20'hcfc7b, 20'hf7b5c, 20'h17b05, 20'ha0c02, 20'h57b82, 20'hd0f9e, 20'h0f6e5, 20'h28c3d, 20'hc005a, 20'heff5d,
    20'h17747, 20'ha9422, 20'h4f382, 20'hd939f, 20'h0f727, 20'h3083d, 20'hc883a, 20'heff3f, 20'h0f768, 20'hb1c22, 20'h46ba3, 20'he1780,
    20'h07748, 20'h3041d, 20'hc8c1a, 20'he8320, 20'h077a9, 20'hc2422, 20'h3e7c4, 20'he9b81, 20'hff789, 20'h303fd, 20'hd13fa, 20'he8721,
    20'h077c9, 20'hca841, 20'h2dfc4, 20'hf1b82, 20'hff7ca, 20'h37ffd, 20'hd97da, 20'he8743, 20'hff409, 20'he2c41, 20'h1dfe4, 20'hf9ba2,
    20'hf7bea, 20'h377de, 20'he1bbb, 20'hf0b44, 20'hff449, 20'hf3041, 20'h0d804, 20'h09ba3, 20'hf782a, 20'h2f3de, 20'he9f9c, 20'hf0b65,
    20'hf7889, 20'h03040, 20'hfd824, 20'h11bc3, 20'hf7869, 20'h273de, 20'hf9f7d, 20'hf0b86, 20'hf78a8, 20'h1b040, 20'hf5844, 20'h19bc4,
    20'hefca9, 20'h1efbf, 20'h0235e, 20'hf8fa6, 20'hef8e6, 20'h2ac5f, 20'he5c44, 20'h217e4, 20'hefce7, 20'h16bbf, 20'h11f5f, 20'hf8fe7,
    20'hefd05, 20'h3a85f, 20'hd6063, 20'h29004, 20'he8106, 20'h0eba0, 20'h19f40, 20'h00c07, 20'he8123, 20'h4a05f, 20'hce482, 20'h30c24,
    20'he8524, 20'h06ba1, 20'h21b41, 20'h08c27, 20'he8122, 20'h51c3e, 20'hbec82, 20'h30844, 20'he8542, 20'hfeba1, 20'h29742, 20'h08c66,
    20'he8520, 20'h5903e, 20'hbf481, 20'h30443, 20'hf0941, 20'heebc2, 20'h31363, 20'h10886, 20'he853e, 20'h6083e, 20'hb7c80, 20'h37c63,
    20'hf095f, 20'he6fc2, 20'h38f84, 20'h108a5, 20'hf093c, 20'h6001e, 20'hb049f, 20'h37862, 20'hf093d, 20'he73c2, 20'h387a5, 20'h108c4,
    20'hf091b, 20'h6741e, 20'hb089e, 20'h37482, 20'hf8d3b, 20'hdf7e3, 20'h403c6, 20'h184c3, 20'hf0cd9, 20'h5effe, 20'hb909e, 20'h2f081,
    20'hf8cf9, 20'hd7be3, 20'h3fbe6, 20'h184e1, 20'hf8cb8, 20'h567fe, 20'hc187d, 20'h26c80, 20'h00cd8, 20'hd7c03, 20'h3f406, 20'h180e0,
    20'h00c77, 20'h45ffe, 20'hc9c5c, 20'h1e89f, 20'h08c97, 20'hd0023, 20'h37026, 20'h1fcff, 20'h00c57, 20'h3dbdf, 20'hda45c, 20'h1689e,
    20'h08c56, 20'hd0423, 20'h2ec46, 20'h1fcdd, 20'h08c17, 20'h257df, 20'hea43c, 20'h0e87e, 20'h10836, 20'hd0c42, 20'h26865, 20'h178dc,
    20'h08fd7, 20'h153df, 20'hfa81c, 20'hfe87d, 20'h10bf6, 20'hd9042, 20'h1e484, 20'h178bb, 20'h10b97, 20'h053c0, 20'h0abfc, 20'hf685d,
    20'h10bb7, 20'he1042, 20'h0e4a3, 20'h1789a, 20'h10b78, 20'hed3c0, 20'h12bdc, 20'hee85c, 20'h18777, 20'he9461, 20'h060c2, 20'h0f47a,
    20'h18b3a, 20'hdd7c1, 20'h227dc, 20'he6c3c, 20'h18739, 20'hf1861, 20'hf64c1, 20'h0f439, 20'h1871b, 20'hcdbc1, 20'h323bd, 20'hdf01c,
    20'h1831a, 20'hf9860, 20'hee4c0, 20'h07419
  };
  localparam [256*20-1:0] PAIRS = SYMMETRIC != 0 ? TURNED : DRAWN;
  assign points = PAIRS[pair*20+:20];
endmodule
