//! `--shard I/N`: one machine's part of work that several do together.
//!
//! Items are numbered from 0 in the order of the whole run, and dealt round robin: shard `I` of
//! `N` does those whose number leaves the rest `I` when divided by `N`. Shards count from 0, as the
//! array jobs of Slurm and Kubernetes do by default.

use std::fmt;

/// Help of `--shard`.
pub const HELP: &str = "Do shard I of N (I counts from 0), one machine's part of the work. auto takes I and N from \
                        a Slurm array job; auto/N takes I from Slurm or Kubernetes (JOB_COMPLETION_INDEX)";

/// The shard of a command line; for `#[command(flatten)]`. Arguments that are themselves flattened as
/// an `Option` have a field of their own instead: clap takes no note of what is flattened in those.
#[derive(Clone, Copy, Debug, clap::Args)]
pub struct ShardArg {
    #[arg(long, value_name = "I/N", value_parser = parse_shard, help = HELP)]
    pub shard: Option<Shard>,
}

/// One of `count` shards, `index` from 0 to `count - 1`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Shard {
    index: u32,
    count: u32,
}

impl Shard {
    /// All there is to do.
    pub const WHOLE: Shard = Shard { index: 0, count: 1 };

    /// Shard `index` of `count`.
    ///
    /// # Errors
    /// Why there is no such shard.
    pub fn new(index: u32, count: u32) -> Result<Shard, String> {
        match (index, count) {
            (_, 0) => Err("there must be at least one shard, and the first is 0/1".to_owned()),
            _ if index >= count => Err(format!(
                "there is no shard {index} of {count}: shards count from 0, so the last is {}/{count}",
                count - 1
            )),
            _ => Ok(Shard { index, count }),
        }
    }

    /// Which share, from 0.
    pub fn index(self) -> u32 {
        self.index
    }

    /// How many shares there are.
    pub fn count(self) -> u32 {
        self.count
    }

    /// Whether the item with this number, from 0, is in the share.
    pub fn has(self, item: usize) -> bool {
        item as u64 % u64::from(self.count) == u64::from(self.index)
    }

    /// Reads `I/N`, `auto` or `auto/N`; `variable` knows the environment.
    fn read(text: &str, variable: impl Fn(&str) -> Option<String>) -> Result<Shard, String> {
        let number = |text: &str| text.parse::<u32>().ok();
        let (index, count) = match text.split_once('/') {
            None => (text, None),
            Some((index, count)) => (index, Some(count)),
        };
        let count = count.map(|count| number(count).ok_or(SYNTAX)).transpose()?;
        match (index, number(index), count) {
            ("auto", _, _) => automatic(count, &variable),
            (_, Some(index), Some(count)) => Shard::new(index, count),
            _ => Err(SYNTAX.to_owned()),
        }
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.index, self.count)
    }
}

const SYNTAX: &str =
    "a shard is I/N with I from 0 to N - 1, such as 0/3, 1/3 and 2/3; or auto; or auto/N";

const SLURM_INDEX: &str = "SLURM_ARRAY_TASK_ID";
const SLURM_FIRST: &str = "SLURM_ARRAY_TASK_MIN";
const SLURM_STEP: &str = "SLURM_ARRAY_TASK_STEP";
const SLURM_COUNT: &str = "SLURM_ARRAY_TASK_COUNT";
const KUBERNETES_INDEX: &str = "JOB_COMPLETION_INDEX";

/// Reads what follows `--shard`.
///
/// # Errors
/// What is wrong with it, or with the variables that it names.
pub fn parse_shard(text: &str) -> Result<Shard, String> {
    Shard::read(text, |name| std::env::var(name).ok())
}

/// The share that the job scheduler gives this process, of `count` or as many as it says.
fn automatic(
    count: Option<u32>,
    variable: &impl Fn(&str) -> Option<String>,
) -> Result<Shard, String> {
    let number = |name: &str| {
        let read = |text: String| {
            let parsed = text.trim().parse::<u32>();
            parsed.map_err(|_| format!("auto: {name} is {text:?}, not a number"))
        };
        variable(name).map(read).transpose()
    };
    if let Some(id) = number(SLURM_INDEX)? {
        let set = |name: &str| number(name)?.ok_or_else(|| missing(SLURM_INDEX, name));
        let (first, of_job) = (set(SLURM_FIRST)?, set(SLURM_COUNT)?);
        let step = number(SLURM_STEP)?.unwrap_or(1).max(1);
        if let Some(count) = count.filter(|&count| count != of_job) {
            return Err(format!("auto/{count}: {SLURM_COUNT} is {of_job}"));
        }
        let from_first = id.checked_sub(first);
        let index = from_first.filter(|from| from % step == 0 && from / step < of_job);
        let index = index.ok_or_else(|| {
            format!(
                "auto: {SLURM_INDEX} {id} is not one of {of_job} indices from {first} in steps of \
                 {step}; submit the array without gaps, or name the shard as I/N"
            )
        })?;
        return Shard::new(index / step, of_job);
    }
    match (number(KUBERNETES_INDEX)?, count) {
        (Some(index), Some(count)) => Shard::new(index, count)
            .map_err(|error| format!("auto/{count}: {KUBERNETES_INDEX}: {error}")),
        (Some(_), None) => Err(format!(
            "auto: {KUBERNETES_INDEX} is set, which tells nothing of the job's completions; say \
             auto/N with their number"
        )),
        (None, _) => Err(format!(
            "auto: neither {SLURM_INDEX} nor {KUBERNETES_INDEX} is set"
        )),
    }
}

fn missing(given: &str, name: &str) -> String {
    format!("auto: {given} is set, but not {name}")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shard(index: u32, count: u32) -> Shard {
        Shard::new(index, count).expect("a shard")
    }

    fn read(text: &str, environment: &[(&str, &str)]) -> Result<Shard, String> {
        Shard::read(text, |name| {
            let found = environment.iter().find(|(known, _)| *known == name);
            found.map(|(_, value)| (*value).to_owned())
        })
    }

    #[test]
    fn shards_count_from_zero() {
        assert_eq!(read("0/1", &[]), Ok(Shard::WHOLE));
        assert_eq!(read("2/3", &[]), Ok(shard(2, 3)));
        assert_eq!(shard(2, 3).to_string(), "2/3");
        for text in ["3/3", "4/3"] {
            let error = read(text, &[]).expect_err(text);
            assert!(error.contains("count from 0"), "{error}");
            assert!(error.contains("last is 2/3"), "{error}");
        }
        assert!(read("0/0", &[]).is_err());
    }

    #[test]
    fn what_is_no_shard_is_refused() {
        for text in [
            "",
            "/",
            "1",
            "1/",
            "/3",
            "-1/3",
            "1/3/5",
            "a/3",
            "1/b",
            "1/4294967296",
            "auto/",
            "auto/x",
        ] {
            let error = read(text, &[]).expect_err(text);
            assert!(error.contains("I/N"), "{text}: {error}");
        }
    }

    #[test]
    fn every_item_is_in_one_share() {
        for count in [1, 3, 7, u32::MAX] {
            for item in [0, 1, 2, 3, 20, 21, usize::MAX] {
                let mine = (0..count.min(7)).filter(|&ix| shard(ix, count).has(item));
                let expected = usize::from((item as u64 % u64::from(count)) < 7);
                assert_eq!(mine.count(), expected, "{item} of {count}");
            }
        }
        let dealt: Vec<usize> = (0..8).filter(|&item| shard(1, 3).has(item)).collect();
        assert_eq!(dealt, [1, 4, 7]);
    }

    #[test]
    fn slurm_says_which() {
        let job = |id, first, step, count| {
            [
                (SLURM_INDEX, id),
                (SLURM_FIRST, first),
                (SLURM_STEP, step),
                (SLURM_COUNT, count),
            ]
        };
        assert_eq!(read("auto", &job("2", "0", "1", "3")), Ok(shard(2, 3)));
        // --array=1-3 and --array=10-30:10.
        assert_eq!(read("auto", &job("3", "1", "1", "3")), Ok(shard(2, 3)));
        assert_eq!(read("auto", &job("20", "10", "10", "3")), Ok(shard(1, 3)));
        assert_eq!(read("auto/3", &job("0", "0", "1", "3")), Ok(shard(0, 3)));
        for (text, job, needle) in [
            (
                "auto/4",
                job("0", "0", "1", "3"),
                "SLURM_ARRAY_TASK_COUNT is 3",
            ),
            // --array=0,2,9.
            ("auto", job("9", "0", "1", "3"), "without gaps"),
            ("auto", job("0", "1", "1", "3"), "not one of"),
            ("auto", job("5", "0", "2", "3"), "not one of"),
            (
                "auto",
                job("x", "0", "1", "3"),
                "SLURM_ARRAY_TASK_ID is \"x\"",
            ),
            ("auto", job("0", "0", "1", "0"), "not one of"),
        ] {
            let error = read(text, &job).expect_err(needle);
            assert!(error.contains(needle), "{error}");
        }
        let error = read("auto", &[(SLURM_INDEX, "1")]).expect_err("no count");
        assert!(error.contains("not SLURM_ARRAY_TASK_MIN"), "{error}");
    }

    #[test]
    fn kubernetes_says_which_of_how_many() {
        let job = [(KUBERNETES_INDEX, "4")];
        assert_eq!(read("auto/7", &job), Ok(shard(4, 7)));
        for (text, needle) in [("auto", "say auto/N"), ("auto/4", "no shard 4 of 4")] {
            let error = read(text, &job).expect_err(text);
            assert!(error.contains(needle), "{error}");
        }
        let error = read("auto/3", &[]).expect_err("no job");
        assert!(error.contains("neither"), "{error}");
    }
}
