//! The worked streams of the specification come to the dump and the transcript beside them.

use std::fs;

use dapple_conformance::clauses;
use dapple_conformance::models::probes::range::INITIAL;
use dapple_conformance::models::range::Bit;
use dapple_conformance::models::regions::writer::{self, Region, Set};
use dapple_conformance::protocol::{Arguments, Mode, Program as _, Status};
use dapple_conformance::reference::Reference;

/// The lines of the fenced blocks of one kind.
fn blocks<'t>(text: &'t str, kind: &str) -> Vec<&'t str> {
    let fence = format!("```{kind}");
    let mut lines = text.lines();
    let mut found = Vec::new();
    while let Some(line) = lines.next() {
        if line == fence {
            found.extend(lines.by_ref().take_while(|line| *line != "```"));
        }
    }
    found
}

fn bytes(lines: &[&str]) -> Vec<u8> {
    let bytes = lines.iter().map(|line| line.split(';').next());
    let words = bytes.flat_map(|bytes| bytes.unwrap_or_default().split_ascii_whitespace());
    words
        .map(|word| {
            assert_eq!(word.len(), 2, "{word}");
            u8::from_str_radix(word, 16).expect("a byte")
        })
        .collect()
}

fn chapter(name: &str) -> String {
    fs::read_to_string(clauses::folder().join(name)).expect(name)
}

/// The chapters with a stream and its dump, and the files of both in `spec/examples`.
const EXAMPLES: [(&str, &str); 4] = [
    ("examples.md", "points"),
    ("examples-probes.md", "probes"),
    ("examples-vertices.md", "vertices"),
    ("examples-regions.md", "regions"),
];

/// A file of `spec/examples`.
fn file(name: &str, kind: &str) -> Vec<u8> {
    let path = clauses::folder().join("examples").join(name);
    fs::read(path.with_extension(kind)).expect(name)
}

/// The types of the records of a stream.
fn record_types(stream: &[u8]) -> Vec<u32> {
    let mut types = Vec::new();
    let mut at = 16;
    while at < stream.len() {
        let word = |offset: usize| {
            let bytes = &stream[at + offset..at + offset + 4];
            u32::from_le_bytes(bytes.try_into().expect("four bytes"))
        };
        types.push(word(0) & 0x7fff);
        at += 32 + word(16) as usize;
    }
    types
}

#[test]
fn the_bytes_decode_to_the_dump() {
    EXAMPLES.into_iter().for_each(decodes_to_its_dump);
}

fn decodes_to_its_dump((name, files): (&str, &str)) {
    let text = chapter(name);
    let stream = bytes(&blocks(&text, "hex"));
    let dump = blocks(&text, "dump").join("\n") + "\n";
    assert!(stream.len() > 400, "the blocks are not found");
    let answer = Reference::default()
        .request(&Arguments::default(), &stream)
        .expect("an answer");
    assert_eq!(String::from_utf8_lossy(&answer.output), dump);
    assert_eq!(answer.status, Status::Complete);
    let records = record_types(&stream).len();
    let said = format!(
        "The stream has {} bytes and {records} records",
        stream.len()
    );
    assert!(text.contains(&said), "{said}");
    assert!(file(files, "dapple") == stream, "{files}.dapple");
    assert!(file(files, "dump") == dump.as_bytes(), "{files}.dump");
}

#[test]
fn the_losses_come_to_the_transcript() {
    let text = chapter("loss.md");
    let stream = bytes(&blocks(&text, "hex"));
    let push = format!("push {}\n", stream.len());
    assert!(text.contains(&push), "{push}");
    let mut script = push.into_bytes();
    script.extend(&stream);
    script.extend(b"resume\nresume\nresume\nfinish\n");
    let arguments = Arguments {
        mode: Mode::Session,
        ..Arguments::default()
    };
    let answer = Reference::default()
        .request(&arguments, &script)
        .expect("an answer");
    let transcript = blocks(&text, "transcript").join("\n") + "\n";
    assert_eq!(String::from_utf8_lossy(&answer.output), transcript);
    assert!(file("loss", "dapple") == stream, "loss.dapple");
    assert!(file("loss", "transcript") == transcript.as_bytes());
}

#[test]
fn each_record_type_that_is_defined_has_its_bytes() {
    let streams = EXAMPLES.map(|(name, _)| bytes(&blocks(&chapter(name), "hex")));
    let types = streams.map(|stream| record_types(&stream)).concat();
    for defined in [1, 2, 3, 4, 5, 6, 7, 0x20, 0x21, 0x22, 0x24] {
        assert!(
            types.contains(&defined),
            "{defined:#x} is not in {types:x?}"
        );
    }
}

/// The worked sections of probes, bit by bit: a range decoder as `spec/probes.md` §6.2 has it, which
/// takes the contexts from the table.
#[test]
fn the_bits_of_probes_are_those_of_the_bytes() {
    let text = chapter("examples-probes.md");
    let part = |line: &str| {
        let hex = text
            .lines()
            .skip_while(|l| !(l.starts_with(line) && l.ends_with("of track 1, range coded")));
        bytes(
            &hex.take_while(|l| !l.starts_with("```") && !l.contains("track 2"))
                .collect::<Vec<_>>(),
        )
    };
    let sections = [part("6b 7f"), part("ef")];
    for (section, said) in sections.iter().zip(["19 bytes, `", "the one byte `"]) {
        let hex: Vec<String> = section.iter().map(|byte| format!("{byte:02x}")).collect();
        let said = format!("{said}{}`", hex.join(" "));
        assert!(text.contains(&said), "{said}");
    }
    let names = context_names();
    let mut sections = sections.into_iter();
    let mut coder = None;
    let mut rows = 0;
    let mut consumed = Vec::new();
    for line in blocks(&text, "bits") {
        let words: Vec<&str> = line.split_whitespace().collect();
        if words[0] == "context" {
            let estimates = INITIAL.map(|b| 256 * u32::from(b) + 128).to_vec();
            coder = sections
                .next()
                .map(|section| Coder::new(section, estimates));
            continue;
        }
        let coder: &mut Coder = coder.as_mut().expect("a section");
        if let [range, code] = words[..] {
            assert_eq!(coder.shown(), [range, code].join("  "), "{line}");
            consumed.push(coder.taken);
            continue;
        }
        let context: Option<usize> = words[0].parse().ok();
        let q = context.map(|context| coder.estimates[context].to_string());
        assert_eq!(q.as_deref().unwrap_or("-"), words[1], "{line}");
        assert_eq!(coder.shown(), words[2..4].join("  "), "{line}");
        assert_eq!(coder.bit(context).to_string(), words[4], "{line}");
        let name = context.map_or("bypass", |context| names[context].as_str());
        assert_eq!(words[5], name, "{line}");
        rows += 1;
    }
    assert!(rows > 60 && sections.next().is_none());
    // As the text says: three bytes beyond the end, and four.
    assert_eq!(consumed, [19 + 3, 1 + 4]);
}

/// The worked section of regions, bit by bit: contexts and estimates are those of the program of
/// `spec/regions.md` §7 for the codes that the text states.
#[test]
fn bits_of_regions_are_those_of_the_codes() {
    let text = chapter("examples-regions.md");
    let of_region = |line: &str| line.starts_with("region ").then(|| line.to_string());
    let stated: Vec<String> = blocks(&text, "text")
        .into_iter()
        .filter_map(of_region)
        .collect();
    let forms = [[2, 0, 1], [0, 1, 1], [2, 0, 1]];
    let regions: Vec<Region> = stated
        .iter()
        .zip(forms)
        .map(|(line, form)| {
            let codes = line.split_whitespace().skip(2);
            Region {
                codes: codes.map(|code| code.parse().expect("a code")).collect(),
                ..Region::new([0.0; 6], form)
            }
        })
        .collect();
    assert_eq!(regions.len(), 3);
    let set = Set::packed(3).of_one();
    let bits = writer::bits(&set, [true, false, false], &regions);
    let hex = text
        .lines()
        .skip_while(|l| !l.ends_with("; regions of track 7, range coded"));
    let coded = bytes(&hex.take_while(|l| *l != "```").collect::<Vec<_>>());
    assert_eq!(
        writer::coded(&set, [true, false, false], &regions).short(),
        coded
    );
    let mut coder = Coder::new(coded, vec![32896; writer::context::ALL]);
    let mut rows = blocks(&text, "bits").into_iter().skip(1);
    for bit in bits {
        let words: Vec<&str> = rows.next().expect("a row").split_whitespace().collect();
        let (context, one) = match bit {
            Bit::In(context, one) => (Some(context), one),
            Bit::Even(one) => (None, one),
        };
        let number = context.map(|context| context.to_string());
        assert_eq!(number.as_deref().unwrap_or("-"), words[0]);
        let q = context.map(|context| coder.estimates[context].to_string());
        assert_eq!(q.as_deref().unwrap_or("-"), words[1]);
        assert_eq!(coder.shown().split("  ").next(), Some(words[2]));
        assert_eq!(coder.bit(context), u32::from(one));
        assert_eq!(words[3], u32::from(one).to_string());
    }
    assert_eq!(rows.next(), None);
}

/// Names of the contexts with their indices, such as `LEVEL[0][1]`.
fn context_names() -> Vec<String> {
    let path = clauses::folder().join("tables/contexts.csv");
    let text = fs::read_to_string(path).expect("the table of contexts");
    let names = text.lines().skip(1).map(|line| {
        let fields: Vec<&str> = line.split(',').collect();
        let indices = fields[2].split_ascii_whitespace();
        let indices: String = indices.map(|index| format!("[{index}]")).collect();
        fields[1].to_string() + &indices
    });
    names.collect()
}

struct Coder {
    bytes: Vec<u8>,
    taken: usize,
    range: u32,
    code: u32,
    estimates: Vec<u32>,
}

impl Coder {
    fn new(bytes: Vec<u8>, estimates: Vec<u32>) -> Coder {
        let mut coder = Coder {
            bytes,
            taken: 0,
            range: u32::MAX,
            code: 0,
            estimates,
        };
        (0..4).for_each(|_| coder.take());
        coder
    }

    fn take(&mut self) {
        let byte = self.bytes.get(self.taken).copied().unwrap_or(0);
        self.code = self.code << 8 | u32::from(byte);
        self.taken += 1;
    }

    fn shown(&self) -> String {
        format!("{:08x}  {:08x}", self.range, self.code)
    }

    fn bit(&mut self, context: Option<usize>) -> u32 {
        let bound = match context {
            Some(context) => (self.range >> 16) * self.estimates[context],
            None => self.range / 2,
        };
        let bit = u32::from(self.code >= bound);
        if bit == 1 {
            self.code -= bound;
            self.range -= bound;
        } else {
            self.range = bound;
        }
        if let Some(context) = context {
            let q = &mut self.estimates[context];
            *q = match bit {
                0 => *q + (65536 - *q) / 32,
                _ => *q - *q / 32,
            };
        }
        while self.range < 1 << 24 {
            self.range <<= 8;
            self.take();
        }
        bit
    }
}
