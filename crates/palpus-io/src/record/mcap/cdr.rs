//! Messages in CDR, little-endian: each number at a multiple of its own size, counted from behind
//! the four bytes of the head.

use crate::record::columns::{Kind, Put, Take, columns_of};

/// Says that what follows is plain CDR, little-endian.
const HEAD: [u8; 4] = [0, 1, 0, 0];

/// A message being written.
pub(super) struct Message<'a> {
    out: &'a mut Vec<u8>,
    /// Offset of the end of the head.
    begin: usize,
}

impl<'a> Message<'a> {
    /// Begins a message at the end of `out`.
    pub(super) fn new(out: &'a mut Vec<u8>) -> Self {
        out.extend(HEAD);
        let begin = out.len();
        Self { out, begin }
    }

    fn align(&mut self, size: usize) {
        while !(self.out.len() - self.begin).is_multiple_of(size) {
            self.out.push(0);
        }
    }

    /// Text, with its length before and a zero behind.
    pub(super) fn text(&mut self, text: &str) {
        self.whole(text.len() as u32 + 1);
        self.out.extend(text.bytes());
        self.out.push(0);
    }
}

impl Put for Message<'_> {
    fn long(&mut self, value: u64) {
        self.align(8);
        self.out.extend(value.to_le_bytes());
    }

    fn whole(&mut self, value: u32) {
        self.align(4);
        self.out.extend(value.to_le_bytes());
    }

    fn double(&mut self, value: f64) {
        self.align(8);
        self.out.extend(value.to_le_bytes());
    }

    /// A sequence of none or one.
    fn optional(&mut self, value: Option<f64>) {
        self.whole(u32::from(value.is_some()));
        if let Some(value) = value {
            self.double(value);
        }
    }

    fn flag(&mut self, value: bool) {
        self.out.push(u8::from(value));
    }
}

/// A message being read.
pub(super) struct Fields<'a> {
    bytes: &'a [u8],
    at: usize,
}

/// A message that ends early or holds what it may not.
pub(super) struct Malformed;

impl<'a> Fields<'a> {
    /// The fields of a message, with its head.
    pub(super) fn new(message: &'a [u8]) -> Result<Self, Malformed> {
        message.strip_prefix(&HEAD).map(|bytes| Self { bytes, at: 0 }).ok_or(Malformed)
    }

    fn next<const N: usize>(&mut self) -> Result<[u8; N], Malformed> {
        let at = self.at.next_multiple_of(N);
        let field = self.bytes.get(at..).and_then(|rest| rest.first_chunk()).ok_or(Malformed)?;
        self.at = at + N;
        Ok(*field)
    }

    /// See [`Message::text`].
    pub(super) fn text(&mut self) -> Result<&'a str, Malformed> {
        let length = self.whole()? as usize;
        let bytes = self.bytes.get(self.at..).and_then(|rest| rest.get(..length)).ok_or(Malformed)?;
        self.at += length;
        let text = bytes.strip_suffix(&[0]).ok_or(Malformed)?;
        std::str::from_utf8(text).map_err(|_| Malformed)
    }
}

impl Take for Fields<'_> {
    type Error = Malformed;

    fn long(&mut self) -> Result<u64, Malformed> {
        self.next().map(u64::from_le_bytes)
    }

    fn whole(&mut self) -> Result<u32, Malformed> {
        self.next().map(u32::from_le_bytes)
    }

    fn double(&mut self) -> Result<f64, Malformed> {
        self.next().map(f64::from_le_bytes)
    }

    fn optional(&mut self) -> Result<Option<f64>, Malformed> {
        match self.whole()? {
            0 => Ok(None),
            1 => self.double().map(Some),
            _ => Err(Malformed),
        }
    }

    fn flag(&mut self) -> Result<bool, Malformed> {
        match self.next()? {
            [0] => Ok(false),
            [1] => Ok(true),
            _ => Err(Malformed),
        }
    }
}

/// Separates a message's definition from those that it is made of.
const RULE: &str = "================================================================================";

const HEADER: &str = "MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n";
const TIME: &str = "MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n";
const POSE: &str = "MSG: geometry_msgs/Pose\nPoint position\nQuaternion orientation\n";
const POINT: &str = "MSG: geometry_msgs/Point\nfloat64 x\nfloat64 y\nfloat64 z\n";
const QUATERNION: &str = "MSG: geometry_msgs/Quaternion\nfloat64 x\nfloat64 y\nfloat64 z\nfloat64 w\n";
const TWIST: &str = "MSG: geometry_msgs/Twist\nVector3 linear\nVector3 angular\n";
const WRENCH: &str = "MSG: geometry_msgs/Wrench\nVector3 force\nVector3 torque\n";
const VECTOR: &str = "MSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n";

/// The definition of a stamped message.
fn stamped(field: &str, parts: &[&str]) -> String {
    let own = format!("std_msgs/Header header\n{field}\n");
    [own.as_str()].iter().chain(&[HEADER, TIME]).chain(parts).copied().collect::<Vec<_>>().join(&format!("{RULE}\n"))
}

/// Definition of `geometry_msgs/msg/PoseStamped`.
pub(super) fn pose_stamped() -> String {
    stamped("Pose pose", &[POSE, POINT, QUATERNION])
}

/// Definition of `geometry_msgs/msg/TwistStamped`.
pub(super) fn twist_stamped() -> String {
    stamped("Twist twist", &[TWIST, VECTOR])
}

/// Definition of `geometry_msgs/msg/WrenchStamped`.
pub(super) fn wrench_stamped() -> String {
    stamped("Wrench wrench", &[WRENCH, VECTOR])
}

/// Definition of `palpus_msgs/msg/Settings`.
pub(super) fn settings() -> String {
    "# The ticks from number `tick` on are stepped with these settings, a line of TOML.\nuint64 tick\nstring toml\n"
        .to_owned()
}

/// Definition of `palpus_msgs/msg/Tick`: the columns of recordings of `format`.
pub(super) fn tick(format: u32) -> String {
    let kind = |kind| match kind {
        Kind::Long => "uint64",
        Kind::Whole => "uint32",
        Kind::Double => "float64",
        Kind::Optional => "float64[<=1]",
        Kind::Flag => "bool",
    };
    columns_of(format).iter().map(|(name, of)| format!("{} {name}\n", kind(*of))).collect()
}
