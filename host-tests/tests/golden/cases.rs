//! Programs that go where mistakes hide, each with its name.

/// Name and program.
pub const EDGE_CASES: &[(&str, &str)] = &[
    ("nothing at all", ""),
    ("comments only", "; nothing\n(to draw)\n\n"),
    (
        "34 steps: 100 by 100 units at S3",
        "G01 X800 Y0 Z0\nG94 S3\nG01 X900 Y100",
    ),
    (
        "moves of no length",
        "G01 X1000 Y1000 Z1000\nG01\nG00\nG28\nG01 X1015\nG01 X1015\nG00 X1015\nG01 Y1000\nG01 Z985",
    ),
    (
        "lengths around whole steps",
        "G01 X1000 Y1000 Z0\nG01 X1005\nG01 X1010.001\nG01 X1014.999\nG01 X1020 Y1005\nG01 X1020 Y1010.0001\n\
         G01 Y1009.9999\nG01 Y1009.9",
    ),
    (
        "decimal lengths that binary fractions do not hold",
        "G01 X1000 Y1000 Z0\nG01 X1003.3\nG01 X1008.3\nG01 X1008.4\nG01 X1013.4 Y1000.1\nG01 Y1005.1\nG01 Y1000.1",
    ),
    (
        "pen-down step: both ends below 500",
        "G94 S2 P50\nG01 Z499.99\nG01 X1100\nG01 X1000 Z500\nG01 X1100 Z499\nG01 X1000 Z0\nG01 X1010 Z499.9999",
    ),
    (
        "pen-up step",
        "G94 P100\nG01 X1250\nG94 P1\nG01 X1240\nG94 P33.3\nG01 X1000 Y500\nG94 P15 S30\nG01 Z0\nG01 X1300",
    ),
    (
        "G94: F means S, P leaves S alone, one at a time or both",
        "G01 Z0\nG94 F3\nG01 X1030\nG94 P20\nG01 X1000\nG94 S7 P40\nG01 X1049\nG94\nG01 Z1000\nG01 Z0 X1000",
    ),
    (
        "step sizes with fractions",
        "G01 X1000 Y1000 Z0\nG94 S1.5\nG01 X1003\nG94 S3.3\nG01 X1009.6\nG94 S2.75 P7.25\nG01 X1000.2\nG01 Z29",
    ),
    (
        "Z out of range",
        "G01 Z-20\nG01 X1100 Z-0.001\nG01 Z1000.5\nG01 X1000 Z99999\nG00 Z-1000\nG00 Z2000\nG01 Z1e-9",
    ),
    (
        "half-way pen",
        "G01 Z499\nG01 Z500\nG01 Z501\nG01 Z250.5\nG01 X1200 Y900 Z750.25",
    ),
    (
        "out of reach, pen up, all around",
        "G01 X3000 Y0\nG01 X2000 Y2000\nG01 X0 Y3000\nG01 X-2000 Y2000\nG01 X-3000 Y10\nG01 X-10 Y-10\n\
         G01 X0 Y-3000\nG01 X2000 Y-2000\nG01 X1950.001 Y0\nG01 X1950 Y1\nG01 X499.99 Y700\nG01 X699.99 Y-700",
    ),
    (
        "out of reach, pen down",
        "G01 X1800 Y0 Z0\nG01 X1990\nG01 X1800 Z0\nG01 X1500 Y1500 Z499\nG01 X1200 Y0 Z100\nG01 X0 Y0 Z500\n\
         G01 X0 Y0 Z499.999",
    ),
    (
        "far out of reach",
        "G01 X1000000 Y1000000\nG01 X-1000000 Y3\nG01 X1e6 Y-1e6 Z-1e6\nG54 S1000\nG01 X1000000 Y-1\n\
         G54 S-1000 X1e6 Y-1e6\nG01 X1e6 Y1e6",
    ),
    (
        "the joints' edges and the corners",
        "G01 X819.15 Y1700\nG01 X819.15 Y-1700\nG01 X400 Y1600\nG01 X1367 Y1526\nG01 X1367 Y-1526\nG01 X600 Y-1650\n\
         G01 X1000 Y1600\nG01 X1200 Y-1560",
    ),
    (
        "along the edges, half a unit inside",
        "G01 X500.5 Y0.5\nG01 Y1520\nG01 X1308 Y1444\nG01 X1949 Y0\nG01 X1308 Y-1444\nG01 X700.5 Y-1565\nG01 Y-0.5\n\
         G01 X701 Y0.5",
    ),
    (
        "on the edges",
        "G01 X500 Y0\nG01 X500 Y1521\nG01 X500 Y0\nG01 X700 Y0\nG01 X700 Y-1566\nG01 X1950 Y0\nG01 X1170 Y1560",
    ),
    (
        "over the body's notch and back, pen down",
        "G01 X510 Y300 Z0\nG01 X720 Y-300\nG01 X510 Y300\nG01 X700 Y-1000\nG01 X500 Y1000",
    ),
    (
        "over the notch, pen up and coarse",
        "G94 P100\nG01 X500 Y500\nG01 X700 Y-500\nG01 X600 Y0\nG01 X700 Y-3\nG01 X500 Y2\nG01 X705 Y-200",
    ),
    (
        "just past the notch's corner",
        "G01 X690 Y100 Z0\nG01 X710.1 Y-100\nG01 X690 Y100\nG01 X709.9 Y-100\nG01 X700 Y100\nG01 X700 Y-100",
    ),
    (
        "G00 in the open",
        "G00 X1414.2 Y0 Z800\nG00 Z200\nG00 X1500 Y-600 Z0\nG00 X1000 Y1000 Z1000\nG00 X1001\nG00 X1600 Y100 Z500",
    ),
    (
        "G00 near the body",
        "G00 X500 Y0\nG00 X500 Y900\nG00 X510 Y300\nG00 X700 Y-900\nG00 X520 Y10 Z0\nG00 X701 Y-10\nG00 X500 Y1520\n\
         G00 X700 Y-1560",
    ),
    (
        "G00 out of reach",
        "G00 X0 Y0 Z1000\nG00 X2500 Y2500 Z0\nG00 X-100 Y-100 Z499\nG00 X1e6 Y0 Z500",
    ),
    (
        "G00 and G01 by turns",
        "G00 X1200 Y300\nG01 Z0\nG01 X1300\nG00 Z1000\nG01 X1200\nG00 X900 Y900 Z0\nG01 X905",
    ),
    (
        "G54: scale first, then offset, never Z nor home",
        "G54 X100 Y0 S2.5\nG01 X400 Y100 Z300\nG01 Z0\nG01 X410\nG28\nG01 Y-40 Z900",
    ),
    (
        "G54: what is left out stays",
        "G54 X500 Y-100\nG01 X500 Y500\nG54 S0.5\nG01 X1000 Y500\nG54 Y100\nG01 X1100\nG54 X0 S1\nG01 X1000\nG54\nG01 X990",
    ),
    (
        "G54: negative and odd scales",
        "G54 X2400 Y1000 S-1\nG01 X1200 Y500 Z0\nG01 X1210 Y490\nG54 X0 Y0 S0.333333\nG01 X3000 Y1500\nG01 X3030\n\
         G54 S1.0000001\nG01 X1000 Y1000\nG54 S0.0000001 X900 Y900\nG01 X100 Y-100\nG01 X1000000",
    ),
    (
        "G54 takes no time and no place",
        "G01 X1100\nG54 X50\nG01 X1100\nG01 Y900\nG54 S2\nG01 X500 Z0\nG54 X0 Y0 S1\nG28",
    ),
    (
        "dwells",
        "G4 P0.25\nG01 X1100 Z0\nG4 S0.03\nG04 P0\nG01 X1105\nG4 P0.0123\nG01 X1000 Z1000\nG4 P0.5",
    ),
    (
        "as clients write it",
        "g01 x900 y300 z1\nG1 X900.0000 Y999.9999999\nG01  X1000  Y1.5e-07 \nG0 Z1E3\nG01 X+1200 Y-.5 F5000 ; home\nG28 ",
    ),
];

/// Ways of a whole number of steps, in decimals that 1/65536 units do not hold.
pub const DECIMAL_STEPS: &[&str] = &[
    "G01 Z0\nG94 S3.7\nG01 X1011.1\nG01 X1000",
    "G01 Z0\nG94 S1.3\nG01 X1003.9",
    "G94 P14.7\nG01 X1044.1\nG01 X1000\nG01 Y985.3",
    "G54 S1.1\nG94 P3.3\nG01 X900\nG01 X909",
];

/// Moves without scale, origin and calibration. No way is a whole number of steps: where offsets are taken off the
/// angles and put back, a unit in the last place would make one more.
pub const BARE_MOVES: &[(&str, &str)] = &[
    (
        "all axes",
        "G40 X1400 Y-300 Z700\nG40 X1200 Y605 Z0\nG40 X1000 Y1000 Z1000\nG01 X1100 Z0\nG40 X1100 Y1000 Z500",
    ),
    (
        "what is left out stays",
        "G40 X1400 Y-300 Z700\nG40 Y203\nG40 X1502\nG40 Z103\nG40\nG01 Z0\nG40 X1450",
    ),
    (
        "scale and origin, and not",
        "G54 X100 Y-50 S2\nG40 X1300 Y405 Z610\nG01 X600 Y200 Z0\nG40 X600 Y200 Z303 Kxy\nG40 X1300 Y302 Z301 Kz\n\
         G40 Z2 Kz\nG40 X652 Kxy",
    ),
    (
        "out of reach",
        "G01 Z0\nG40 X3000 Y0\nG40 X1503 Y0 Z2000\nG40 X1501 Y0 Z-20\nG40 X0 Y0 Z800\nG40 X2500 Y100 Z100 Kxy",
    ),
];
