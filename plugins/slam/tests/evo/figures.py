"""Prints figures.csv: errors of published trajectories by evo (https://github.com/MichaelGrupp/evo, 1.38.1).

pip install evo==1.38.1; python figures.py $MANIFACTOR_DATA/tum > figures.csv
"""
import copy
import sys

import numpy as np
from evo.core import metrics, sync
from evo.core.units import Unit
from evo.tools import file_interface

TRAJECTORIES = {
    "freiburg1_desk": [
        "dvo_vo",
        "opencv_rgbdicp_frame_to_frame_vo",
        "orbslam2_rgbd_a_duanyongli",
        "orbslam2_rgbd_b_jichao",
    ],
    "freiburg2_desk": [
        "orbslam2_rgbd_a_evo",
        "orbslam2_rgbd_b_rginjapan",
        "orbslam2_based_zzhfro",
        "orbslam_mono_keyframes_evo",
    ],
    "freiburg3_long_office_household": ["orbslam2_rgbd_a_sugoi", "dxslam_drifting_gpetrak"],
}


def row(name, alignment, measure, metric, pair):
    metric.process_data(pair)
    s = metric.get_all_statistics()
    figures = [s[k] for k in ("rmse", "mean", "median", "std", "min", "max")]
    print(name, alignment, measure, len(metric.error), *(f"{x:.12g}" for x in figures), sep=",")


print("trajectory,alignment,measure,count,rmse,mean,median,std,min,max")
for sequence, names in TRAJECTORIES.items():
    folder = f"{sys.argv[1]}/rgbd_dataset_{sequence}"
    truth = file_interface.read_tum_trajectory_file(f"{folder}/groundtruth.txt")
    for name in names:
        estimate = file_interface.read_tum_trajectory_file(f"{folder}/trajectories/{name}.txt")
        # dvo_vo.txt has its last two lines out of order; our reader puts them in order
        estimate.reduce_to_ids(np.argsort(estimate.timestamps, kind="stable"))
        true, found = sync.associate_trajectories(truth, estimate, max_diff=0.02)
        for alignment in ("se3", "sim3", "first_pose", "none"):
            aligned = copy.deepcopy(found)
            if alignment in ("se3", "sim3"):
                aligned.align(true, correct_scale=alignment == "sim3")
            elif alignment == "first_pose":
                aligned.align_origin(true)
            pair, label = (true, aligned), f"rgbd_dataset_{sequence}/trajectories/{name}.txt"
            row(label, alignment, "ate", metrics.APE(metrics.PoseRelation.translation_part), pair)
            if alignment not in ("se3", "sim3"):
                continue
            for delta, pairing in ((1, "consecutive"), (10, "consecutive"), (10, "all")):
                for part, relation in (
                    ("translation", metrics.PoseRelation.translation_part),
                    ("rotation", metrics.PoseRelation.rotation_angle_rad),
                ):
                    metric = metrics.RPE(relation, delta, Unit.frames, all_pairs=pairing == "all")
                    row(label, alignment, f"rpe {delta} {pairing} {part}", metric, pair)
