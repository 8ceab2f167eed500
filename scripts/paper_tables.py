"""The paper's tables: their rows as options of phimvs, their published figures, and what a run says of its times.

For scripts/ablation and scripts/eth3d. F1 in percent at TOLERANCES; times are the paper's, one RTX 3070 and a Core i5, images
of 3024x2016.
"""
TOLERANCES = (0.01, 0.02, 0.05, 0.1)  # metres

# Rows of the table of the training scenes -> options after --preset paper.
VARIANTS = {"PHI-MVS/P": "--PhiInference.mode off", "PHI-MVS/M": "--PhiInference.mode min_cost",
            "PHI-MVS": "--PhiInference.mode mrf"}

# Training scene -> F1 of each of VARIANTS.
TRAINING = {
    "courtyard": ((65.19, 85.06, 93.92, 96.86), (66.45, 86.12, 94.78, 97.49), (66.83, 86.40, 94.96, 97.60)),
    "delivery_area": ((70.09, 85.00, 94.18, 97.20), (73.93, 89.09, 96.99, 98.66), (74.83, 89.52, 97.06, 98.65)),
    "electro": ((68.47, 80.78, 90.24, 94.90), (73.16, 85.20, 93.06, 96.48), (73.88, 85.52, 93.11, 96.49)),
    "facade": ((48.25, 68.66, 86.82, 92.46), (48.86, 69.23, 87.65, 93.08), (49.32, 69.53, 87.71, 93.13)),
    "kicker": ((57.97, 68.63, 81.33, 89.83), (68.68, 81.74, 90.81, 94.26), (70.61, 82.38, 90.71, 94.07)),
    "meadow": ((39.28, 55.46, 70.11, 78.26), (49.45, 64.34, 79.67, 87.16), (50.93, 65.67, 80.78, 87.91)),
    "office": ((49.99, 61.80, 75.94, 85.33), (67.50, 80.25, 92.17, 96.91), (69.62, 81.35, 92.40, 97.12)),
    "pipes": ((59.50, 68.67, 82.03, 91.23), (73.50, 81.38, 90.31, 96.72), (74.84, 82.36, 91.03, 97.17)),
    "playground": ((54.96, 71.34, 87.08, 93.53), (56.75, 72.72, 87.62, 93.92), (57.25, 73.07, 87.68, 93.90)),
    "relief": ((73.35, 84.25, 91.88, 95.44), (75.17, 86.93, 94.20, 96.54), (75.53, 87.31, 94.32, 96.46)),
    "relief_2": ((71.62, 83.68, 92.26, 95.87), (73.87, 86.39, 94.34, 96.96), (74.32, 86.76, 94.48, 96.93)),
    "terrace": ((75.37, 86.88, 94.76, 98.08), (77.84, 89.06, 96.23, 98.65), (78.35, 89.24, 96.21, 98.64)),
    "terrains": ((75.32, 84.28, 92.00, 96.08), (83.06, 91.00, 96.03, 98.07), (84.17, 91.56, 96.16, 98.10))}
TRAINING_MEAN = ((62.26, 75.73, 87.12, 92.70), (68.32, 81.80, 91.84, 95.76), (69.27, 82.36, 92.05, 95.86))

# Of the test scenes together.
TEST_MEAN = {"f1": (75.8, 86.43, 93.89, 96.77), "accuracy": (74.92, 86.38, 94.34, 96.96),
             "completeness": (77.49, 86.83, 93.59, 96.65)}
TEST = ("botanical_garden", "boulders", "bridge", "door", "exhibition_hall", "lecture_room", "living_room", "lounge",
        "observatory", "old_computer", "statue", "terrace_2")

# (r_now, r_orig) -> F1 over the training scenes, and seconds of the estimation of an image.
WINDOWS = {
    (5, 5): ((69.17, 82.28, 91.80, 95.63), 9.79), (5, 6): ((69.34, 82.40, 91.98, 95.81), 10.02),
    (6, 6): ((69.23, 82.38, 91.99, 95.83), 12.58), (5, 7): ((69.27, 82.36, 92.05, 95.86), 9.57),
    (7, 7): ((69.11, 82.29, 92.05, 95.95), 16.41), (5, 8): ((69.04, 82.16, 91.98, 95.88), 10.04),
    (8, 8): ((68.69, 81.97, 91.92, 95.90), 20.92), (5, 9): ((68.70, 81.85, 91.85, 95.83), 10.51),
    (9, 9): ((68.23, 81.58, 91.73, 95.83), 25.91), (5, 10): ((68.38, 81.62, 91.70, 95.78), 10.86),
    (10, 10): ((67.89, 81.27, 91.50, 95.73), 31.60)}

INFERENCE_SECONDS = "9"     # of an image: the whole of plane hypothesis inference
DECODING_SECONDS = "2 to 3"  # of it the message passing, one pass
# What F1 loses where images are reduced to a quarter of their original size, half of the paper's usual one.
SMALLER_IMAGES_LOSE = (11.67, 6.02, 3.06, 2.00)


def displacement_options(longest_side):
    """t_tau of images of this size: it is in pixels, and the paper's images are 3024 wide."""
    return f"--PhiStereo.min_displacement {min(0.1, 0.1 * longest_side / 3024):.4g}"


def window_options(now, orig):
    """r_now/r_orig: the window reaches r_orig pixels with 2 r_now + 1 samples to a side."""
    return f"--PatchMatchStereo.window_radius {orig} --PatchMatchStereo.window_step {orig / now:.9g}"


def seconds_per_image(run, stage, device_stage):
    """Of an entry of `runs` in stereo/phimvs.json: of the device where it tells them, else wall time; None: not in that run."""
    for device in run["devices"] if run else []:
        for entry in device["stages"]:
            if entry["stage"] == device_stage and entry["images"]:
                return entry["seconds"] / entry["images"]
    stages = [entry for entry in run["stages"] if entry["stage"] == stage and entry["images"]] if run else []
    return stages[0]["seconds"] / stages[0]["images"] if stages else None


def estimation_seconds(run):
    return seconds_per_image(run, "photometric", "estimation")


def inference_seconds(run):
    return seconds_per_image(run, "inferred", "inference")


def cells(figures, digits=2):
    """Markdown cells; a figure of None is unknown, text stays."""
    return [f if isinstance(f, str) else "-" if f is None else f"{f:.{digits}f}" for f in figures]


def table(titles, rows):
    """Markdown lines: the first column is a name, the others stand right."""
    lines = ["| | " + " | ".join(titles) + " |", "|---|" + "--:|" * len(titles)]
    return lines + [f"| {name} | " + " | ".join(row) + " |" for name, row in rows]
