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
  logic [19:0] pairs[0:255];
  generate
    if (SYMMETRIC != 0) begin : turned
      initial begin
      pairs[0] = 20'hee4c0; pairs[1] = 20'h30b59; pairs[2] = 20'h1f13b; pairs[3] = 20'h01b5e; pairs[4] = 20'h3777c; pairs[5] = 20'he139d;
      pairs[6] = 20'hdfbc6; pairs[7] = 20'h390c0; pairs[8] = 20'hf64c1; pairs[9] = 20'h28f78; pairs[10] = 20'h2755d; pairs[11] = 20'hf9b7d;
      pairs[12] = 20'h37b9b; pairs[13] = 20'hd8fbc; pairs[14] = 20'hdf7a5; pairs[15] = 20'h314c1; pairs[16] = 20'h060c2; pairs[17] = 20'h293b7;
      pairs[18] = 20'h2755f; pairs[19] = 20'hf1b7c; pairs[20] = 20'h383ba; pairs[21] = 20'hd8bbc; pairs[22] = 20'he7385; pairs[23] = 20'h298c2;
      pairs[24] = 20'h0e4a3; pairs[25] = 20'h217f7; pairs[26] = 20'h2f941; pairs[27] = 20'he979b; pairs[28] = 20'h387da; pairs[29] = 20'hd07db;
      pairs[30] = 20'hef364; pairs[31] = 20'h21ca3; pairs[32] = 20'h1e484; pairs[33] = 20'h19837; pairs[34] = 20'h2fd43; pairs[35] = 20'he13ba;
      pairs[36] = 20'h30bfa; pairs[37] = 20'hd03fb; pairs[38] = 20'hf6f43; pairs[39] = 20'h12084; pairs[40] = 20'h26865; pairs[41] = 20'h11857;
      pairs[42] = 20'h28125; pairs[43] = 20'hd8fda; pairs[44] = 20'h30c3a; pairs[45] = 20'hd7c1b; pairs[46] = 20'hfef42; pairs[47] = 20'h0a065;
      pairs[48] = 20'h2ec46; pairs[49] = 20'h01898; pairs[50] = 20'h28506; pairs[51] = 20'hd081a; pairs[52] = 20'h2905a; pairs[53] = 20'hdf83b;
      pairs[54] = 20'h06f40; pairs[55] = 20'hfa046; pairs[56] = 20'h37026; pairs[57] = 20'hf98d9; pairs[58] = 20'h288e8; pairs[59] = 20'hd043a;
      pairs[60] = 20'h2147a; pairs[61] = 20'hdf45b; pairs[62] = 20'h0ef5f; pairs[63] = 20'hea026; pairs[64] = 20'h3f406; pairs[65] = 20'hf18fa;
      pairs[66] = 20'h20ca9; pairs[67] = 20'hd005a; pairs[68] = 20'h1989b; pairs[69] = 20'he707c; pairs[70] = 20'h16f5e; pairs[71] = 20'he1c06;
      pairs[72] = 20'h3fbe6; pairs[73] = 20'he951b; pairs[74] = 20'h1906a; pairs[75] = 20'hd7c7b; pairs[76] = 20'h118bc; pairs[77] = 20'heec9d;
      pairs[78] = 20'h1ef7d; pairs[79] = 20'hd9be6; pairs[80] = 20'h403c6; pairs[81] = 20'he153d; pairs[82] = 20'h1902a; pairs[83] = 20'hd789b;
      pairs[84] = 20'h01cdd; pairs[85] = 20'hf6c9d; pairs[86] = 20'h2737c; pairs[87] = 20'hd17c6; pairs[88] = 20'h387a5; pairs[89] = 20'hd913f;
      pairs[90] = 20'h117ea; pairs[91] = 20'hdf4bc; pairs[92] = 20'hf9cde; pairs[93] = 20'hfe8be; pairs[94] = 20'h2779b; pairs[95] = 20'hc93a5;
      pairs[96] = 20'h38f84; pairs[97] = 20'hd0d21; pairs[98] = 20'h097aa; pairs[99] = 20'he70dd; pairs[100] = 20'hf18df; pairs[101] = 20'h068bf;
      pairs[102] = 20'h2fbba; pairs[103] = 20'hc0b84; pairs[104] = 20'h31363; pairs[105] = 20'hd0922; pairs[106] = 20'h01769; pairs[107] = 20'heecde;
      pairs[108] = 20'he98c1; pairs[109] = 20'h0e8a0; pairs[110] = 20'h2ffda; pairs[111] = 20'hc0763; pairs[112] = 20'h29742; pairs[113] = 20'hd0104;
      pairs[114] = 20'hf9748; pairs[115] = 20'hf68c0; pairs[116] = 20'he14c2; pairs[117] = 20'h16ca1; pairs[118] = 20'h2801a; pairs[119] = 20'hc7f42;
      pairs[120] = 20'h21b41; pairs[121] = 20'hd7ce6; pairs[122] = 20'hf1707; pairs[123] = 20'hfe8c1; pairs[124] = 20'hd90c3; pairs[125] = 20'h1eca2;
      pairs[126] = 20'h2843a; pairs[127] = 20'hc7741; pairs[128] = 20'h19f40; pairs[129] = 20'hd78c7; pairs[130] = 20'he92e5; pairs[131] = 20'h068c2;
      pairs[132] = 20'hd0ca4; pairs[133] = 20'h27083; pairs[134] = 20'h2885a; pairs[135] = 20'hcf340; pairs[136] = 20'h11f5f; pairs[137] = 20'hdf4a8;
      pairs[138] = 20'he0ec3; pairs[139] = 20'h0e8a3; pairs[140] = 20'hd0885; pairs[141] = 20'h2f464; pairs[142] = 20'h28c7b; pairs[143] = 20'hd6f5f;
      pairs[144] = 20'h0235e; pairs[145] = 20'hdf069; pairs[146] = 20'he0ec1; pairs[147] = 20'h168a4; pairs[148] = 20'hc8066; pairs[149] = 20'h2f864;
      pairs[150] = 20'h2109b; pairs[151] = 20'hdeb5e; pairs[152] = 20'hf9f7d; pairs[153] = 20'he6c29; pairs[154] = 20'hd8adf; pairs[155] = 20'h1ec85;
      pairs[156] = 20'hcfc46; pairs[157] = 20'h37c45; pairs[158] = 20'h190bc; pairs[159] = 20'he677d; pairs[160] = 20'he9f9c; pairs[161] = 20'heebe9;
      pairs[162] = 20'hd86dd; pairs[163] = 20'h27066; pairs[164] = 20'hd7826; pairs[165] = 20'h30025; pairs[166] = 20'h114dd; pairs[167] = 20'hf639c;
      pairs[168] = 20'he1bbb; pairs[169] = 20'hf6bc9; pairs[170] = 20'hd82fb; pairs[171] = 20'h2f446; pairs[172] = 20'hd77e6; pairs[173] = 20'h30405;
      pairs[174] = 20'h094de; pairs[175] = 20'hfe3bb; pairs[176] = 20'hd97da; pairs[177] = 20'h06b88; pairs[178] = 20'hdff1a; pairs[179] = 20'h37806;
      pairs[180] = 20'hdf3c6; pairs[181] = 20'h28be5; pairs[182] = 20'h014c0; pairs[183] = 20'h0e3da; pairs[184] = 20'hd13fa; pairs[185] = 20'h0eb47;
      pairs[186] = 20'hdfb38; pairs[187] = 20'h37fe6; pairs[188] = 20'he6fa6; pairs[189] = 20'h28fc5; pairs[190] = 20'hf94c1; pairs[191] = 20'h1e3fa;
      pairs[192] = 20'hc8c1a; pairs[193] = 20'h16b26; pairs[194] = 20'he7777; pairs[195] = 20'h303c6; pairs[196] = 20'heeb85; pairs[197] = 20'h213a4;
      pairs[198] = 20'hf14c2; pairs[199] = 20'h2641a; pairs[200] = 20'hc883a; pairs[201] = 20'h1ef05; pairs[202] = 20'hef3b6; pairs[203] = 20'h307a5;
      pairs[204] = 20'hf6b64; pairs[205] = 20'h19783; pairs[206] = 20'he94a3; pairs[207] = 20'h2e83a; pairs[208] = 20'hc005a; pairs[209] = 20'h26ee3;
      pairs[210] = 20'hef3f6; pairs[211] = 20'h30b85; pairs[212] = 20'h06743; pairs[213] = 20'h11783; pairs[214] = 20'he10a4; pairs[215] = 20'h36c5a;
      pairs[216] = 20'hcfc7b; pairs[217] = 20'h2f2e1; pairs[218] = 20'hf6c36; pairs[219] = 20'h28f64; pairs[220] = 20'h0e742; pairs[221] = 20'h09b62;
      pairs[222] = 20'he0c85; pairs[223] = 20'h3f07b; pairs[224] = 20'hcf49c; pairs[225] = 20'h376ff; pairs[226] = 20'hfec76; pairs[227] = 20'h21343;
      pairs[228] = 20'h16b41; pairs[229] = 20'h01b61; pairs[230] = 20'hd8866; pairs[231] = 20'h4789c; pairs[232] = 20'hd70bd; pairs[233] = 20'h37afe;
      pairs[234] = 20'h06cb7; pairs[235] = 20'h19742; pairs[236] = 20'h1eb5f; pairs[237] = 20'hf9b60; pairs[238] = 20'hd8446; pairs[239] = 20'h47cbd;
      pairs[240] = 20'hdecde; pairs[241] = 20'h3031c; pairs[242] = 20'h0ecd8; pairs[243] = 20'h11b40; pairs[244] = 20'h26f5e; pairs[245] = 20'hf177f;
      pairs[246] = 20'hd8006; pairs[247] = 20'h404de; pairs[248] = 20'he68df; pairs[249] = 20'h3073a; pairs[250] = 20'h16d19; pairs[251] = 20'h09b5f;
      pairs[252] = 20'h2f35d; pairs[253] = 20'he977e; pairs[254] = 20'hdffe6; pairs[255] = 20'h40cdf;
      end
    end else begin : drawn
      initial begin
      pairs[0] = 20'h07419; pairs[1] = 20'hee4c0; pairs[2] = 20'hf9860; pairs[3] = 20'h1831a; pairs[4] = 20'hdf01c; pairs[5] = 20'h323bd;
      pairs[6] = 20'hcdbc1; pairs[7] = 20'h1871b; pairs[8] = 20'h30b59; pairs[9] = 20'h1f13b; pairs[10] = 20'h01b5e; pairs[11] = 20'h3777c;
      pairs[12] = 20'h07760; pairs[13] = 20'he139d; pairs[14] = 20'h08efe; pairs[15] = 20'h1ff41; pairs[16] = 20'h3941d; pairs[17] = 20'hdfbc6;
      pairs[18] = 20'h390c0; pairs[19] = 20'hf8024; pairs[20] = 20'ha0bc2; pairs[21] = 20'hfa563; pairs[22] = 20'h27b20; pairs[23] = 20'hfe3e8;
      pairs[24] = 20'h170a4; pairs[25] = 20'hd6b56; pairs[26] = 20'h367e1; pairs[27] = 20'hea878; pairs[28] = 20'hd1821; pairs[29] = 20'h32b5f;
      pairs[30] = 20'h157c3; pairs[31] = 20'hf7b25; pairs[32] = 20'he6016; pairs[33] = 20'hd183c; pairs[34] = 20'hf5485; pairs[35] = 20'h166fb;
      pairs[36] = 20'h4185e; pairs[37] = 20'hf8adb; pairs[38] = 20'h37406; pairs[39] = 20'haff9b; pairs[40] = 20'h1773b; pairs[41] = 20'hc97ea;
      pairs[42] = 20'h15b20; pairs[43] = 20'h0eb9a; pairs[44] = 20'h403b5; pairs[45] = 20'h678e0; pairs[46] = 20'h0a358; pairs[47] = 20'he90b9;
      pairs[48] = 20'h3650a; pairs[49] = 20'he0922; pairs[50] = 20'h264ac; pairs[51] = 20'h080e0; pairs[52] = 20'h17b89; pairs[53] = 20'h033c3;
      pairs[54] = 20'hd1097; pairs[55] = 20'h213a4; pairs[56] = 20'hdf787; pairs[57] = 20'hf33de; pairs[58] = 20'h1873e; pairs[59] = 20'h50f20;
      pairs[60] = 20'hf76fb; pairs[61] = 20'hd0f5e; pairs[62] = 20'h313f7; pairs[63] = 20'h00481; pairs[64] = 20'h20300; pairs[65] = 20'h30985;
      pairs[66] = 20'h3937f; pairs[67] = 20'hdf525; pairs[68] = 20'h4ef62; pairs[69] = 20'hf8d19; pairs[70] = 20'he5fc7; pairs[71] = 20'hed520;
      pairs[72] = 20'hc6362; pairs[73] = 20'hbed05; pairs[74] = 20'hd57e5; pairs[75] = 20'h31442; pairs[76] = 20'h59082; pairs[77] = 20'h0dbe9;
      pairs[78] = 20'h17101; pairs[79] = 20'h317e9; pairs[80] = 20'hd285a; pairs[81] = 20'he1fb7; pairs[82] = 20'h068a6; pairs[83] = 20'h56f75;
      pairs[84] = 20'h0fb46; pairs[85] = 20'h51386; pairs[86] = 20'h058fd; pairs[87] = 20'he78bf; pairs[88] = 20'h0205f; pairs[89] = 20'h270e7;
      pairs[90] = 20'h01c1e; pairs[91] = 20'he0866; pairs[92] = 20'h493b4; pairs[93] = 20'hde37f; pairs[94] = 20'hc8bdc; pairs[95] = 20'h29038;
      pairs[96] = 20'hc2000; pairs[97] = 20'hd0fd6; pairs[98] = 20'hd975b; pairs[99] = 20'he846c; pairs[100] = 20'h49b5d; pairs[101] = 20'hc06f7;
      pairs[102] = 20'ha93c0; pairs[103] = 20'h00425; pairs[104] = 20'he7fc5; pairs[105] = 20'h3872a; pairs[106] = 20'h20d5f; pairs[107] = 20'hd8839;
      pairs[108] = 20'hef007; pairs[109] = 20'h1acfd; pairs[110] = 20'h31b79; pairs[111] = 20'hf5f55; pairs[112] = 20'hf585e; pairs[113] = 20'h07867;
      pairs[114] = 20'h4fbc7; pairs[115] = 20'hf289d; pairs[116] = 20'hf2782; pairs[117] = 20'he783c; pairs[118] = 20'h1ffa4; pairs[119] = 20'h197aa;
      pairs[120] = 20'haf85a; pairs[121] = 20'h1d762; pairs[122] = 20'h4945e; pairs[123] = 20'hcd93b; pairs[124] = 20'h4f428; pairs[125] = 20'he137c;
      pairs[126] = 20'hf0bf9; pairs[127] = 20'hb175e; pairs[128] = 20'hdfae3; pairs[129] = 20'hdf042; pairs[130] = 20'he72ba; pairs[131] = 20'hb8b75;
      pairs[132] = 20'h3fc39; pairs[133] = 20'h1eef9; pairs[134] = 20'h4fc9b; pairs[135] = 20'he0d06; pairs[136] = 20'he1c0a; pairs[137] = 20'hf67a4;
      pairs[138] = 20'h28000; pairs[139] = 20'hf7c6c; pairs[140] = 20'hba3e7; pairs[141] = 20'hd03da; pairs[142] = 20'h29b9a; pairs[143] = 20'hda83c;
      pairs[144] = 20'h39856; pairs[145] = 20'hc8c1d; pairs[146] = 20'hbf465; pairs[147] = 20'hfeb82; pairs[148] = 20'h203e3; pairs[149] = 20'h19b47;
      pairs[150] = 20'h40937; pairs[151] = 20'h51415; pairs[152] = 20'h38064; pairs[153] = 20'h40459; pairs[154] = 20'h086e0; pairs[155] = 20'h56786;
      pairs[156] = 20'h36026; pairs[157] = 20'h38b38; pairs[158] = 20'hf8e85; pairs[159] = 20'hd56fd; pairs[160] = 20'h0fc88; pairs[161] = 20'h217b9;
      pairs[162] = 20'h26f60; pairs[163] = 20'he9338; pairs[164] = 20'hfa2c7; pairs[165] = 20'he0442; pairs[166] = 20'h37f96; pairs[167] = 20'h0fc1a;
      pairs[168] = 20'hf041d; pairs[169] = 20'hf00a0; pairs[170] = 20'hb0aa6; pairs[171] = 20'h267f7; pairs[172] = 20'h1f35d; pairs[173] = 20'h38022;
      pairs[174] = 20'hf9b59; pairs[175] = 20'ha1776; pairs[176] = 20'h4f846; pairs[177] = 20'h057de; pairs[178] = 20'hc8bfe; pairs[179] = 20'h05145;
      pairs[180] = 20'h48ae3; pairs[181] = 20'h010c2; pairs[182] = 20'h3f402; pairs[183] = 20'hc749b; pairs[184] = 20'h08cbf; pairs[185] = 20'h264c5;
      pairs[186] = 20'h57f89; pairs[187] = 20'h3133d; pairs[188] = 20'hfff7b; pairs[189] = 20'h2641c; pairs[190] = 20'h2a498; pairs[191] = 20'h15fe5;
      pairs[192] = 20'h56ba8; pairs[193] = 20'h01360; pairs[194] = 20'h2df20; pairs[195] = 20'h37144; pairs[196] = 20'h198db; pairs[197] = 20'hb67d4;
      pairs[198] = 20'h477c1; pairs[199] = 20'h51fd7; pairs[200] = 20'hdd844; pairs[201] = 20'h0819b; pairs[202] = 20'h2ff61; pairs[203] = 20'hffb09;
      pairs[204] = 20'h127fe; pairs[205] = 20'he08be; pairs[206] = 20'h5645d; pairs[207] = 20'h483c6; pairs[208] = 20'hd189f; pairs[209] = 20'h2877a;
      pairs[210] = 20'hf24c0; pairs[211] = 20'h48f9d; pairs[212] = 20'hf1419; pairs[213] = 20'h05b44; pairs[214] = 20'h4680c; pairs[215] = 20'h5843f;
      pairs[216] = 20'h08fa3; pairs[217] = 20'h07fc5; pairs[218] = 20'he8f46; pairs[219] = 20'h37bbe; pairs[220] = 20'hc83e1; pairs[221] = 20'hea442;
      pairs[222] = 20'h67469; pairs[223] = 20'h23140; pairs[224] = 20'h560a3; pairs[225] = 20'hbfff7; pairs[226] = 20'h1040b; pairs[227] = 20'hddb45;
      pairs[228] = 20'hfaf97; pairs[229] = 20'h11498; pairs[230] = 20'h46afc; pairs[231] = 20'hdf49f; pairs[232] = 20'h39bfe; pairs[233] = 20'hf0326;
      pairs[234] = 20'h10eda; pairs[235] = 20'h11ca2; pairs[236] = 20'hd96c0; pairs[237] = 20'h12f87; pairs[238] = 20'he04db; pairs[239] = 20'h107fe;
      pairs[240] = 20'h2a879; pairs[241] = 20'h18b20; pairs[242] = 20'hff4e9; pairs[243] = 20'h4ec3d; pairs[244] = 20'hfe48c; pairs[245] = 20'h0fce0;
      pairs[246] = 20'h49002; pairs[247] = 20'haf6a3; pairs[248] = 20'h00005; pairs[249] = 20'hd28a8; pairs[250] = 20'hcfaba; pairs[251] = 20'hde42a;
      pairs[252] = 20'h27e83; pairs[253] = 20'hefb01; pairs[254] = 20'hef394; pairs[255] = 20'hca01c;
      end
    end
  endgenerate
  assign points = pairs[pair];
endmodule
