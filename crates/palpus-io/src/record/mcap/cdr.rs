//! Messages in little-endian CDR. Each number is aligned to a multiple of its size, counted from
//! the end of the four-byte header.

use crate::record::columns::{Kind, Put, Take, columns_of};

/// Header that stands for plain little-endian CDR.
const HEAD: [u8; 4] = [0, 1, 0, 0];

/// A message being written.
pub(super) struct Message<'a> {
    out: &'a mut Vec<u8>,
    /// Offset of the end of the message header.
    begin: usize,
}

impl<'a> Message<'a> {
    /// Starts a message at the end of `out`.
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

    /// Appends text with its length and a final zero byte.
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

    /// Appends a sequence of zero or one elements.
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

/// Error: a message ends too early or contains an invalid value.
pub(super) struct Malformed;

impl<'a> Fields<'a> {
    /// Starts to read a message, including its header.
    pub(super) fn new(message: &'a [u8]) -> Result<Self, Malformed> {
        message.strip_prefix(&HEAD).map(|bytes| Self { bytes, at: 0 }).ok_or(Malformed)
    }

    fn next<const N: usize>(&mut self) -> Result<[u8; N], Malformed> {
        let at = self.at.next_multiple_of(N);
        let field = self.bytes.get(at..).and_then(|rest| rest.first_chunk()).ok_or(Malformed)?;
        self.at = at + N;
        Ok(*field)
    }

    /// Counterpart of [`Message::text`].
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

/// Separates the definition of a message from the definitions of its parts.
const RULE: &str = "================================================================================";

const HEADER: &str = "MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n";
const TIME: &str = "MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n";
const POSE: &str = "MSG: geometry_msgs/Pose\nPoint position\nQuaternion orientation\n";
const POINT: &str = "MSG: geometry_msgs/Point\nfloat64 x\nfloat64 y\nfloat64 z\n";
const QUATERNION: &str = "MSG: geometry_msgs/Quaternion\nfloat64 x\nfloat64 y\nfloat64 z\nfloat64 w\n";
const TWIST: &str = "MSG: geometry_msgs/Twist\nVector3 linear\nVector3 angular\n";
const WRENCH: &str = "MSG: geometry_msgs/Wrench\nVector3 force\nVector3 torque\n";
const VECTOR: &str = "MSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n";

/// Returns the definition of a message with a header and one field.
fn stamped(field: &str, parts: &[&str]) -> String {
    let own = format!("std_msgs/Header header\n{field}\n");
    [own.as_str()].iter().chain(&[HEADER, TIME]).chain(parts).copied().collect::<Vec<_>>().join(&format!("{RULE}\n"))
}

/// Returns the definition of `geometry_msgs/msg/PoseStamped`.
pub(super) fn pose_stamped() -> String {
    stamped("Pose pose", &[POSE, POINT, QUATERNION])
}

/// Returns the definition of `geometry_msgs/msg/TwistStamped`.
pub(super) fn twist_stamped() -> String {
    stamped("Twist twist", &[TWIST, VECTOR])
}

/// Returns the definition of `geometry_msgs/msg/WrenchStamped`.
pub(super) fn wrench_stamped() -> String {
    stamped("Wrench wrench", &[WRENCH, VECTOR])
}

/// Returns the definition of `palpus_msgs/msg/Settings`.
pub(super) fn settings() -> String {
    "# The ticks from number `tick` on are stepped with these settings, a line of TOML.\nuint64 tick\nstring toml\n"
        .to_owned()
}

/// Returns the definition of `palpus_msgs/msg/Tick`: the columns of recordings of version `format`.
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
