"""Published Bekker-Janosi soils, as their sources print them. Numbers only; :mod:`ddagr_gym.presets` builds soils.

Columns: name, source, n [-], k_c [kN/m^(n+1)], k_phi [kN/m^(n+2)], cohesion [kPa], friction angle [deg], K [m].
LLL: Land Locomotion Laboratory; WES: Waterways Experiment Station; most are collected in Wong, Theory of Ground
Vehicles, table 2.3. Where a source gives no shear modulus, the table's K is that of similar soils.
"""

PUBLISHED_SOILS: tuple[tuple[str, str, float, float, float, float, float, float], ...] = (
    ("dry_sand_lll_0", "Dry sand (LLL), 0% moisture", 1.1, 0.99, 1528.43, 1.04, 28.0, 0.025),
    ("sandy_loam_lll_15", "Sandy loam (LLL), 15% moisture", 0.7, 5.27, 1515.04, 1.72, 29.0, 0.025),
    ("sandy_loam_lll_22", "Sandy loam (LLL), 22% moisture", 0.2, 2.56, 43.12, 1.38, 38.0, 0.025),
    (
        "sandy_loam_michigan_strong_buchele_11",
        "Sandy loam Michigan (Strong,Buchele), 11% moisture",
        0.9,
        52.53,
        1127.97,
        4.83,
        20.0,
        0.02,
    ),
    (
        "sandy_loam_michigan_strong_buchele_23",
        "Sandy loam Michigan (Strong,Buchele), 23% moisture",
        0.4,
        11.42,
        808.96,
        9.65,
        35.0,
        0.02,
    ),
    ("sandy_loam_hanamoto_26", "Sandy loam (Hanamoto), 26% moisture", 0.3, 2.79, 141.11, 13.79, 22.0, 0.02),
    ("sandy_loam_hanamoto_32", "Sandy loam (Hanamoto), 32% moisture", 0.5, 0.77, 51.91, 5.17, 11.0, 0.02),
    ("clayey_soil_thailand_38", "Clayey soil (Thailand), 38% moisture", 0.5, 13.19, 692.15, 4.14, 13.0, 0.006),
    ("clayey_soil_thailand_55", "Clayey soil (Thailand), 55% moisture", 0.7, 16.03, 1262.53, 2.07, 10.0, 0.01),
    ("heavy_clay_wes_25", "Heavy clay (WES), 25% moisture", 0.13, 12.7, 1555.95, 68.95, 34.0, 0.006),
    ("heavy_clay_wes_40", "Heavy clay (WES), 40% moisture", 0.11, 1.84, 103.27, 20.69, 6.0, 0.01),
    ("lean_clay_wes_22", "Lean clay (WES), 22% moisture", 0.2, 16.43, 1724.69, 68.95, 20.0, 0.006),
    ("lean_clay_wes_32", "Lean clay (WES), 32% moisture", 0.15, 1.52, 119.61, 13.79, 11.0, 0.01),
    ("lete_sand_wong", "LETE sand (Wong)", 0.79, 102.0, 5301.0, 1.3, 31.1, 0.012),
    ("upland_sandy_loam_wong_51", "Upland sandy loam (Wong), 51% moisture", 1.1, 74.6, 2080.0, 3.3, 33.7, 0.02),
    ("rubicon_sandy_loam_wong_43", "Rubicon sandy loam (Wong), 43% moisture", 0.66, 6.9, 752.0, 3.7, 29.8, 0.02),
    (
        "north_gower_clayey_loam_wong_46",
        "North Gower clayey loam (Wong), 46% moisture",
        0.73,
        41.6,
        2471.0,
        6.1,
        26.6,
        0.02,
    ),
    ("grenville_loam_wong_24", "Grenville loam (Wong), 24% moisture", 1.01, 0.06, 5880.0, 3.1, 29.8, 0.02),
    ("snow_u_s", "Snow (U.S.)", 1.6, 4.37, 196.72, 1.03, 19.7, 0.03),
    ("snow_u_s_harrison", "Snow (U.S., Harrison)", 1.6, 2.49, 245.9, 0.62, 23.2, 0.03),
    ("snow_sweden", "Snow (Sweden)", 1.44, 10.55, 66.08, 6.0, 20.7, 0.03),
    ("ishigami_regolith_simulant_dry_sand", "Ishigami regolith simulant/dry sand", 1.0, 1.37, 814.0, 0.8, 37.2, 0.025),
    ("lunar_nominal", "Lunar nominal", 1.0, 1.4, 820.0, 0.17, 35.0, 0.018),
    ("hit_lss1_ding", "HIT-LSS1 (Ding 2011/2015)", 1.1, 15.6, 2407.4, 0.25, 31.9, 0.011),
    ("soil_direct_90_sand_cmu", "Soil Direct #90 sand (Pavolv/CMU, k only)", 1.46, 0.0, 8000.0, 1.0, 29.0, 0.021),
    ("krc_coarse_pit", "KRC coarse pit", 0.4567, 32.48, 931.8, 1.56, 30.35, 0.0186),
    ("mer_dlr_mech_mars_simulant", "MER/DLR mech. Mars simulant", 0.8, 5.79, 180.0, 0.3, 17.8, 0.01),
    ("irobomech_2020_sand", "IRobomech 2020 sand (exp.)", 1.1, 1.0, 500.0, 0.762, 22.3, 0.02),
)
