//! The functions that create and use worlds.

use palpus::{Object, Settings, WorkLimit};

use crate::body::{body_of, palpus_body};
use crate::pointer::{In, InArray, Out, OutArray};
use crate::result::{Fault, entry, palpus_result};
use crate::settings::palpus_settings;
use crate::value::{palpus_contact, palpus_pose, palpus_twist, palpus_wrench};
use crate::world::{Hosted, Motion, WORLDS, palpus_object, palpus_probe, palpus_tick, palpus_tool, palpus_world};

/// Creates an empty world without gravity. `settings` applies to contacts between objects and may
/// be NULL for the defaults. Each tool has its own settings.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpus_world_create(
    settings: *const palpus_settings,
    world: *mut palpus_world,
) -> palpus_result {
    // SAFETY: the caller follows the header.
    let (settings, world) = unsafe { (In::new(settings, "settings"), Out::new(world, "world")) };
    entry(|| {
        world.check()?;
        let settings = settings.get_if_any()?.map_or(Ok(Settings::default()), |settings| settings.read())?;
        world.put(palpus_world { id: WORLDS.insert(Hosted::new(settings)?)? })
    })
}

/// Destroys a world with all its objects and tools.
#[unsafe(no_mangle)]
pub extern "C" fn palpus_world_destroy(world: palpus_world) -> palpus_result {
    entry(|| WORLDS.remove(world.id))
}

/// Sets the gravity that acts on free objects: x, y, z in m/s^2, in the world's axes. A new world
/// has no gravity.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpus_world_set_gravity(world: palpus_world, gravity: *const f64) -> palpus_result {
    // SAFETY: the caller follows the header.
    let gravity = unsafe { In::new(gravity.cast::<[f64; 3]>(), "gravity") };
    entry(|| {
        let gravity = gravity.get()?;
        if !gravity.iter().all(|x| x.is_finite()) {
            return Err(Fault::value("gravity contains a number that is not finite; correct it"));
        }
        WORLDS.change(world.id, |hosted| {
            hosted.world.set_gravity(gravity.into());
            Ok(())
        })
    })
}

fn add(
    world: palpus_world,
    body: palpus_body,
    pose: &In<palpus_pose>,
    out: &Out<palpus_object>,
    motion: Motion,
    mass: f64,
) -> Result<(), Fault> {
    out.check()?;
    let pose = pose.get()?.checked().map_err(|fault| fault.of("pose"))?;
    let body = body_of(body)?.body.clone();
    let object = match motion {
        Motion::Fixed | Motion::Held => Object::fixed(body, pose),
        Motion::Driven => Object::driven(body, pose),
        Motion::Free => Object::free_of_mass(body, pose, mass),
    };
    out.put(WORLDS.change(world.id, |hosted| hosted.add(object, motion))?)
}

/// Adds an object that never moves. `pose` is the pose of its frame in the world.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpus_world_add_fixed(
    world: palpus_world,
    body: palpus_body,
    pose: *const palpus_pose,
    object: *mut palpus_object,
) -> palpus_result {
    // SAFETY: the caller follows the header.
    let (pose, object) = unsafe { (In::new(pose, "pose"), Out::new(object, "object")) };
    entry(|| add(world, body, &pose, &object, Motion::Fixed, 0.0))
}

/// Adds an object that your program moves with palpus_world_drive. The object stays at `pose` until
/// then.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpus_world_add_driven(
    world: palpus_world,
    body: palpus_body,
    pose: *const palpus_pose,
    object: *mut palpus_object,
) -> palpus_result {
    // SAFETY: the caller follows the header.
    let (pose, object) = unsafe { (In::new(pose, "pose"), Out::new(object, "object")) };
    entry(|| add(world, body, &pose, &object, Motion::Driven, 0.0))
}

/// Adds an object of mass `mass` (kg) that moves under contact, friction and gravity. The object
/// starts at rest at `pose`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpus_world_add_free(
    world: palpus_world,
    body: palpus_body,
    pose: *const palpus_pose,
    mass: f64,
    object: *mut palpus_object,
) -> palpus_result {
    // SAFETY: the caller follows the header.
    let (pose, object) = unsafe { (In::new(pose, "pose"), Out::new(object, "object")) };
    entry(|| add(world, body, &pose, &object, Motion::Free, mass))
}

/// Adds a tool that is held through a device. The state of the device is the next element of
/// `probes` in palpus_world_step.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpus_world_add_tool(
    world: palpus_world,
    body: palpus_body,
    settings: *const palpus_settings,
    tool: *mut palpus_tool,
) -> palpus_result {
    // SAFETY: the caller follows the header.
    let (settings, tool) = unsafe { (In::new(settings, "settings"), Out::new(tool, "tool")) };
    entry(|| {
        tool.check()?;
        let settings = settings.get()?.read()?;
        tool.put(WORLDS.change(world.id, |hosted| hosted.add_tool(body, settings))?)
    })
}

/// Makes one step. `dt` is the time since the previous step, s. `probes` has the state of each
/// tool's device, in the order in which the tools were added. The function writes to `wrenches` the
/// wrench for each device: about its grip, in the world's axes, within its limits. `wrenches` may
/// be NULL. `count` is the number of tools. The step reads the system's clock to keep to the time
/// budget of its settings.
///
/// If a device's state is not valid, its wrench is zero, the other tools continue, and the function
/// returns PALPUS_ERROR_VALUE after the step. After any other error no step was made, and all
/// wrenches are zero. Allocates no memory and does not wait.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpus_world_step(
    world: palpus_world,
    probes: *const palpus_probe,
    wrenches: *mut palpus_wrench,
    count: usize,
    dt: f64,
) -> palpus_result {
    // SAFETY: the caller follows the header.
    let (probes, wrenches) =
        unsafe { (InArray::new(probes, count, "probes"), OutArray::new(wrenches, count, "wrenches")) };
    entry(|| {
        wrenches.check_if_any()?;
        // The wrenches stay zero if an error or a panic ends the call before the step is done.
        (0..wrenches.len()).for_each(|k| wrenches.put(k, palpus_wrench::default()));
        probes.check()?;
        WORLDS.change(world.id, |hosted| {
            let bad = hosted.step(&probes, count, dt)?;
            hosted.wrenches().take(wrenches.len()).enumerate().for_each(|(k, wrench)| wrenches.put(k, wrench));
            bad.map_or(Ok(()), Err)
        })
    })
}

/// Writes the result of the last step for a tool.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpus_world_get_tick(
    world: palpus_world,
    tool: palpus_tool,
    tick: *mut palpus_tick,
) -> palpus_result {
    // SAFETY: the caller follows the header.
    let tick = unsafe { Out::new(tick, "tick") };
    entry(|| WORLDS.read(world.id, |hosted| tick.put(hosted.world.tick(hosted.tool(tool)?).into())))
}

/// Writes the contacts of a tool in the last step, in the world's frame; a is the tool. Writes the
/// first `capacity` contacts, and the total number to `count`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpus_world_contacts(
    world: palpus_world,
    tool: palpus_tool,
    contacts: *mut palpus_contact,
    capacity: usize,
    count: *mut usize,
) -> palpus_result {
    // SAFETY: the caller follows the header.
    let (contacts, count) = unsafe { (OutArray::new(contacts, capacity, "contacts"), Out::new(count, "count")) };
    entry(|| {
        contacts.check()?;
        WORLDS.read(world.id, |hosted| {
            let found = &hosted.world.tick(hosted.tool(tool)?).contacts;
            count.put(found.len())?;
            found.iter().take(capacity).enumerate().for_each(|(k, contact)| contacts.put(k, contact.into()));
            Ok(())
        })
    })
}

/// Writes the contacts of two objects in the last step, in the world's frame. Otherwise works like
/// palpus_world_contacts.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpus_world_contacts_between(
    world: palpus_world,
    a: palpus_object,
    b: palpus_object,
    contacts: *mut palpus_contact,
    capacity: usize,
    count: *mut usize,
) -> palpus_result {
    // SAFETY: the caller follows the header.
    let (contacts, count) = unsafe { (OutArray::new(contacts, capacity, "contacts"), Out::new(count, "count")) };
    entry(|| {
        contacts.check()?;
        count.check()?;
        WORLDS.read(world.id, |hosted| {
            let [(a, _), (b, _)] = [hosted.object(a)?, hosted.object(b)?];
            let found = hosted.world.contacts(a, b);
            let mut total = 0;
            for contact in found {
                if total < capacity {
                    contacts.put(total, (&contact).into());
                }
                total += 1;
            }
            count.put(total)
        })
    })
}

/// Writes the object that is a tool's body.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpus_world_tool_object(
    world: palpus_world,
    tool: palpus_tool,
    object: *mut palpus_object,
) -> palpus_result {
    // SAFETY: the caller follows the header.
    let object = unsafe { Out::new(object, "object") };
    entry(|| WORLDS.read(world.id, |hosted| object.put(hosted.object_of(tool)?)))
}

/// Writes the pose of an object's frame in the world.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpus_world_get_pose(
    world: palpus_world,
    object: palpus_object,
    pose: *mut palpus_pose,
) -> palpus_result {
    // SAFETY: the caller follows the header.
    let pose = unsafe { Out::new(pose, "pose") };
    entry(|| WORLDS.read(world.id, |hosted| pose.put(hosted.world.pose(hosted.object(object)?.0).into())))
}

/// Writes the velocity of an object: of its centre of mass, in the world's axes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpus_world_get_twist(
    world: palpus_world,
    object: palpus_object,
    twist: *mut palpus_twist,
) -> palpus_result {
    // SAFETY: the caller follows the header.
    let twist = unsafe { Out::new(twist, "twist") };
    entry(|| WORLDS.read(world.id, |hosted| twist.put(hosted.world.twist(hosted.object(object)?.0).into())))
}

/// Sets the pose and the velocity of a driven object. `twist` is the velocity of the origin of its
/// frame, in the world's axes. You can call this function at any rate; between two calls the object
/// continues at this velocity.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpus_world_drive(
    world: palpus_world,
    object: palpus_object,
    pose: *const palpus_pose,
    twist: *const palpus_twist,
) -> palpus_result {
    // SAFETY: the caller follows the header.
    let (pose, twist) = unsafe { (In::new(pose, "pose"), In::new(twist, "twist")) };
    entry(|| {
        let pose = pose.get()?.checked().map_err(|fault| fault.of("pose"))?;
        let twist = twist.get()?.checked().map_err(|fault| fault.of("twist"))?;
        WORLDS.change(world.id, |hosted| {
            let (id, motion) = hosted.object(object)?;
            only_for(motion == Motion::Driven, "only an object that was added as driven can be driven")?;
            hosted.world.drive(id, pose, twist);
            Ok(())
        })
    })
}

/// Moves an object to `pose`, at rest. Fails for the body of a tool, because its device determines
/// its pose.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpus_world_put(
    world: palpus_world,
    object: palpus_object,
    pose: *const palpus_pose,
) -> palpus_result {
    // SAFETY: the caller follows the header.
    let pose = unsafe { In::new(pose, "pose") };
    entry(|| {
        let pose = pose.get()?.checked().map_err(|fault| fault.of("pose"))?;
        WORLDS.change(world.id, |hosted| {
            let (id, motion) = hosted.object(object)?;
            only_for(motion != Motion::Held, "a tool's device determines its pose, so it cannot be put elsewhere")?;
            hosted.world.put(id, pose);
            Ok(())
        })
    })
}

/// Gives a free object a velocity: of its centre of mass, in the world's axes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpus_world_throw(
    world: palpus_world,
    object: palpus_object,
    twist: *const palpus_twist,
) -> palpus_result {
    // SAFETY: the caller follows the header.
    let twist = unsafe { In::new(twist, "twist") };
    entry(|| {
        let twist = twist.get()?.checked().map_err(|fault| fault.of("twist"))?;
        WORLDS.change(world.id, |hosted| {
            let (id, motion) = hosted.object(object)?;
            only_for(motion == Motion::Free, "only a free object can be given a velocity")?;
            hosted.world.throw(id, twist);
            Ok(())
        })
    })
}

/// Changes the settings of a tool from the next step on. Allocates no memory, so capacity and
/// shading must be the same as when the tool was added.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpus_world_set_tool_settings(
    world: palpus_world,
    tool: palpus_tool,
    settings: *const palpus_settings,
) -> palpus_result {
    // SAFETY: the caller follows the header.
    let settings = unsafe { In::new(settings, "settings") };
    entry(|| {
        let settings = settings.get()?.read()?;
        WORLDS.change(world.id, |hosted| {
            let tool = hosted.tool(tool)?;
            Ok(hosted.world.set_tool_settings(tool, &settings)?)
        })
    })
}

/// Limits the queries of each step to about `work` units of work, instead of the time budget of the
/// settings. Pairs that a query does not reach keep their extrapolated contacts and come first in
/// the next step. 0: the time budget is the limit again. palpus_tick.work is the work of a step.
#[unsafe(no_mangle)]
pub extern "C" fn palpus_world_allow(world: palpus_world, work: u64) -> palpus_result {
    entry(|| {
        WORLDS.change(world.id, |hosted| {
            hosted.world.allow(if work > 0 { WorkLimit::Units(work) } else { WorkLimit::TimeBudget });
            Ok(())
        })
    })
}

/// Discards the data of earlier steps. Objects keep their poses and velocities.
#[unsafe(no_mangle)]
pub extern "C" fn palpus_world_clear(world: palpus_world) -> palpus_result {
    entry(|| {
        WORLDS.change(world.id, |hosted| {
            hosted.world.clear();
            Ok(())
        })
    })
}

fn only_for(allowed: bool, text: &str) -> Result<(), Fault> {
    if allowed { Ok(()) } else { Err(Fault::new(palpus_result::PalpusErrorHandle, text)) }
}
