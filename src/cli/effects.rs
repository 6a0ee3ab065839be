//! Options that have no effect beside others: which option needs what, and the warnings.
//!
//! Each command whose options depend on its model or method has a table of all its options; a test
//! compares the tables with the command line.

use super::output;
use clap::ArgMatches;
use clap::parser::ValueSource;

/// Options and the choices that they need, as a user would type them: one of `needs` has to be
/// active. No needs: they always have an effect.
pub struct Effect {
    needs: &'static [&'static str],
    options: &'static [&'static str],
}

/// The choice of the model `points`.
pub const POINTS: &str = "--model points";
/// The choice of the model `probes`.
pub const PROBES: &str = "--model probes";
/// A chart of baked obscurance.
pub const BAKED: &str = "--baked";
/// `points` that are only updated where a camera sees them.
pub const VISIBILITY: &str = "--model points without --no-visibility";
/// Probes with a tolerance.
pub const PACKED: &str = "--model probes with --coding packed";
/// Direct light whose samples are spread over a pixel.
pub const SPREAD: &str = "--method direct with --supersample";
/// A frame by its number.
pub const FRAME: &str = "--frame";
/// A number of frames.
pub const FRAMES: &str = "--frames";

pub const METHOD_POINTS: &str = "--method points";
pub const METHOD_VERTICES: &str = "--method vertices";
pub const RTAO: &str = "--method rtao";
pub const NONE: &str = "--method none";
pub const PATH: &str = "--method path";
pub const DIRECT: &str = "--method direct";
pub const METHOD_PROBES: &str = "--method probes";
pub const DDGI: &str = "--method ddgi";

/// A bake that is one task of several.
pub const TASK: &str = "--task";
/// A bake that has outputs of its own.
pub const NO_TASK: &str = "a bake without --task";
/// A bake into a copy of the scene.
pub const GLTF: &str = "--gltf";
pub const OCCLUSION: &str = "--gltf with --into occlusion";
/// A bake into a stream.
pub const OUTPUT: &str = "--output";
pub const FOLIAGE: &str = "--foliage";
/// A page with pictures.
pub const REPORT: &str = "--report";
pub const TWO_DISTANCES: &str = "two --distances";

const POINTS_OPTIONS: &[&str] = &[
    "density",
    "thinning",
    "rays",
    "distance",
    "threshold",
    "width",
    "space",
    "min_ao",
    "overflow",
    "no_visibility",
    "budget",
];
/// [`POINTS_OPTIONS`] without those that baked obscurance has, too.
const POINTS_ALONE: &[&str] = &[
    "density",
    "thinning",
    "threshold",
    "width",
    "space",
    "min_ao",
    "overflow",
    "no_visibility",
    "budget",
];
const PROBES_OPTIONS: &[&str] = &[
    "probes",
    "volume",
    "samples",
    "hysteresis",
    "adaptive",
    "warm_up",
    "visibility_side",
    "visibility_step",
    "visibility_updates",
    "coding",
    "sky",
];

/// Limits of decoders.
const LIMITS: &[&str] = &[
    "max_stored_bytes",
    "max_unpacked_bytes",
    "max_frame_bytes",
    "max_zstd_window_bytes",
    "max_tracks",
    "max_path_bytes",
    "max_state_bytes",
    "max_work_per_byte",
];

const ENCODE: &[Effect] = &[
    Effect {
        needs: &[],
        options: LIMITS,
    },
    Effect {
        needs: &[],
        options: &[
            "scene",
            "gltf_scene",
            "animation",
            "model",
            "quality",
            "output",
            "json",
            "frame",
            "time",
            "frames",
            "fps",
            "seed",
            "compression",
            "keyframe_interval",
        ],
    },
    Effect {
        needs: &[POINTS],
        options: POINTS_OPTIONS,
    },
    Effect {
        needs: &[VISIBILITY],
        options: &["camera", "eye", "target", "size", "fov_margin"],
    },
    Effect {
        needs: &[PROBES],
        options: PROBES_OPTIONS,
    },
    Effect {
        needs: &[PROBES],
        options: &["inside", "fit"],
    },
    Effect {
        needs: &[PACKED],
        options: &["tolerance"],
    },
];

const DEMO: &[Effect] = &[
    Effect {
        needs: &[],
        options: LIMITS,
    },
    Effect {
        needs: &[],
        options: &[
            "scene",
            "gltf_scene",
            "animation",
            "model",
            "quality",
            "out",
            "camera",
            "eye",
            "target",
            "size",
            "frame",
            "time",
            "frames",
            "fps",
            "seed",
            "compression",
            "keyframe_interval",
        ],
    },
    Effect {
        needs: &[POINTS],
        options: POINTS_OPTIONS,
    },
    Effect {
        needs: &[VISIBILITY],
        options: &["fov_margin"],
    },
    Effect {
        needs: &[PROBES],
        options: PROBES_OPTIONS,
    },
    Effect {
        needs: &[PROBES],
        options: &["inside", "fit"],
    },
    Effect {
        needs: &[PACKED],
        options: &["tolerance"],
    },
];

const CHART: &[Effect] = &[
    Effect {
        needs: &[POINTS],
        options: LIMITS,
    },
    Effect {
        needs: &[],
        options: &[
            "scene",
            "gltf_scene",
            "animation",
            "model",
            "baked",
            "output",
            "camera",
            "eye",
            "target",
            "size",
            "frame",
            "time",
        ],
    },
    Effect {
        needs: &[POINTS, PROBES],
        options: &["quality", "frames", "seed"],
    },
    Effect {
        needs: &[POINTS],
        options: POINTS_ALONE,
    },
    Effect {
        needs: &[POINTS, BAKED],
        options: &["rays", "distance"],
    },
    Effect {
        needs: &[BAKED],
        options: &["points"],
    },
    Effect {
        needs: &[POINTS],
        options: &[
            "densities",
            "cameras",
            "scored",
            "server_rates",
            "latency_ms",
            "compression",
            "keyframe_interval",
        ],
    },
    Effect {
        needs: &[POINTS, FRAME, FRAMES],
        options: &["fps"],
    },
    Effect {
        needs: &[VISIBILITY],
        options: &["fov_margin"],
    },
    Effect {
        needs: &[PROBES],
        options: PROBES_OPTIONS,
    },
    Effect {
        needs: &[PROBES, BAKED],
        options: &["reference"],
    },
    Effect {
        needs: &[PROBES],
        options: &["parts", "exposure", "curves"],
    },
    Effect {
        needs: &[PACKED],
        options: &["tolerance"],
    },
    // The chart shows both.
    Effect {
        needs: &["dapple encode"],
        options: &["inside", "fit"],
    },
];

const RENDER: &[Effect] = &[
    Effect {
        needs: &[METHOD_POINTS, METHOD_VERTICES, METHOD_PROBES, DDGI],
        options: LIMITS,
    },
    Effect {
        needs: &[],
        options: &[
            "scene",
            "gltf_scene",
            "animation",
            "method",
            "output",
            "camera",
            "eye",
            "target",
            "size",
            "frame",
            "time",
        ],
    },
    Effect {
        needs: &[METHOD_POINTS, METHOD_VERTICES, METHOD_PROBES, DDGI],
        options: &["stream", "server_fps", "latency_ms"],
    },
    Effect {
        needs: &[FRAME],
        options: &["fps"],
    },
    Effect {
        needs: &[METHOD_POINTS, METHOD_PROBES],
        options: &["fallback"],
    },
    Effect {
        needs: &[METHOD_PROBES],
        options: &["interpolation", "occlusion"],
    },
    Effect {
        needs: &[RTAO],
        options: &["distance", "rays"],
    },
    Effect {
        needs: &[METHOD_POINTS, METHOD_VERTICES, RTAO, NONE],
        options: &["ao_only"],
    },
    Effect {
        needs: &[
            METHOD_POINTS,
            METHOD_VERTICES,
            RTAO,
            NONE,
            METHOD_PROBES,
            DDGI,
        ],
        options: &["backend"],
    },
    Effect {
        needs: &[PATH, SPREAD],
        options: &["samples"],
    },
    Effect {
        needs: &[PATH],
        options: &["bounces", "part", "state"],
    },
    Effect {
        needs: &[PATH, DIRECT],
        options: &["no_coats", "supersample", "linear"],
    },
    Effect {
        needs: &[PATH, DIRECT, METHOD_PROBES, DDGI],
        options: &["sky", "exposure"],
    },
];

const BAKE: &[Effect] = &[
    Effect {
        needs: &[],
        options: &[
            "scene",
            "gltf_scene",
            "animation",
            "frame",
            "time",
            "samples",
            "face_samples",
            "rays",
            "distances",
            "ao",
            "separate",
            "remap",
            "instances",
            "tolerance",
            "regions",
            "alpha",
            "task",
            "merge",
            "foliage",
        ],
    },
    Effect {
        needs: &[FOLIAGE],
        options: &["shrubs", "trees", "shrub_density"],
    },
    Effect {
        needs: &[OUTPUT],
        options: &["bits", "compression", "escalate"],
    },
    Effect {
        needs: &[OUTPUT],
        options: LIMITS,
    },
    Effect {
        needs: &[TWO_DISTANCES],
        options: &["blend"],
    },
    Effect {
        needs: &[NO_TASK],
        options: &["output", "gltf", "report", "json"],
    },
    Effect {
        needs: &[GLTF],
        options: &["into"],
    },
    Effect {
        needs: &[OCCLUSION],
        options: &["texture_size"],
    },
    Effect {
        needs: &[TASK],
        options: &["parts", "resume"],
    },
    Effect {
        needs: &[REPORT],
        options: &["camera", "eye", "target", "size"],
    },
];

/// The table of a command; `None` where all options always have an effect.
fn table(command: &str) -> Option<&'static [Effect]> {
    match command {
        "encode" => Some(ENCODE),
        "demo" => Some(DEMO),
        "chart" => Some(CHART),
        "render" => Some(RENDER),
        "bake" => Some(BAKE),
        _ => None,
    }
}

/// The options that the user gave to a command.
#[derive(Debug, Default)]
pub struct Given {
    command: String,
    /// Their ids, and how the user sees them: `--name` or `NAME`.
    options: Vec<(String, String)>,
}

impl Given {
    /// The options on the command line of a subcommand, in the order of its help.
    pub fn new(command: &clap::Command, matches: &ArgMatches) -> Given {
        let typed = |arg: &&clap::Arg| {
            let source = matches.value_source(arg.get_id().as_str());
            source == Some(ValueSource::CommandLine)
        };
        let options = command.get_arguments().filter(typed).map(|arg| {
            let shown = match (arg.get_long(), arg.get_value_names()) {
                (Some(long), _) => format!("--{long}"),
                (None, Some([name, ..])) => name.to_string(),
                (None, _) => arg.get_id().to_string(),
            };
            (arg.get_id().to_string(), shown)
        });
        Given {
            command: command.get_name().to_owned(),
            options: options.collect(),
        }
    }

    /// Whether an option was given.
    pub fn has(&self, option: &str) -> bool {
        self.options.iter().any(|(id, _)| id == option)
    }

    /// Warns once of each option that has no effect where only these choices are active.
    pub fn warn_without_effect(&self, active: &[&str]) {
        for (option, needs) in self.without_effect(active) {
            output::warn(&format!(
                "{option} has no effect: it needs {}",
                needs.join(" or ")
            ));
        }
    }

    fn without_effect(&self, active: &[&str]) -> Vec<(&str, &'static [&'static str])> {
        let table = table(&self.command).unwrap_or_default();
        let needs = |id: &str| table.iter().find(|e| e.options.contains(&id));
        let idle = self.options.iter().filter_map(|(id, shown)| {
            let needs = needs(id)?.needs;
            let works = needs.is_empty() || needs.iter().any(|need| active.contains(need));
            (!works).then_some((&shown[..], needs))
        });
        idle.collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    fn commands() -> clap::Command {
        let mut all = super::super::Cli::command();
        all.build();
        all
    }

    fn given(line: &str) -> Given {
        let all = commands();
        let words = std::iter::once("dapple").chain(line.split_whitespace());
        let matches = all.clone().try_get_matches_from(words).expect("parsed");
        let (name, matches) = matches.subcommand().expect("a subcommand");
        Given::new(all.find_subcommand(name).expect("it"), matches)
    }

    #[test]
    fn every_option_is_in_the_table_once() {
        let mut seen = 0;
        for command in commands().get_subcommands() {
            let Some(table) = table(command.get_name()) else {
                continue;
            };
            seen += 1;
            let ids = command.get_arguments().map(|arg| arg.get_id().as_str());
            let mut ids: Vec<&str> = ids.filter(|id| *id != "help").collect();
            let mut listed: Vec<&str> = table.iter().flat_map(|e| e.options).copied().collect();
            ids.sort_unstable();
            listed.sort_unstable();
            assert_eq!(ids, listed, "{}", command.get_name());
        }
        assert_eq!(seen, 5);
    }

    #[test]
    fn options_without_effect_are_found() {
        let idle = |line: &str, active: &[&str]| -> Vec<String> {
            let given = given(line);
            let idle = given.without_effect(active);
            idle.iter().map(|(option, _)| option.to_string()).collect()
        };
        let light =
            "encode hall -o a --model probes --density 1024 --sky 1,1,1 --size 8x8 --seed 1";
        assert_eq!(idle(light, &[PROBES]), ["--size", "--density"]);
        assert_eq!(idle(light, &[PROBES, POINTS, VISIBILITY]), [""; 0]);
        assert_eq!(idle(light, &[POINTS]), ["--size", "--sky"]);
        let picture = "render a.dapple --scene hall -o a.png --linear a.pfm --fps 30";
        assert_eq!(idle(picture, &[METHOD_PROBES]), ["--fps", "--linear"]);
        assert_eq!(idle(picture, &[PATH, FRAME]), ["STREAM"]);
        assert_eq!(idle("compare a.png b.png --linear", &[]), [""; 0]);
    }
}
