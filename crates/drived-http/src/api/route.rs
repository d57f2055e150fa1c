//! One row of the table of routes: what is served at an address, and how that is described.

use axum::{
    handler::Handler,
    http::Method,
    routing::{MethodFilter, MethodRouter, on},
};
use drive_fleet::alarms::AlarmView;
use drived_plant::plant::{Plant, parameters::WrittenView, views::CommandView};
use schemars::{JsonSchema, Schema, SchemaGenerator};

use super::parameter::NewValue;

/// How the schema of a type is made.
pub(super) type Describe = fn(&mut SchemaGenerator) -> Schema;

/// One method at one address.
pub(super) struct Route {
    pub(super) path: &'static str,
    pub(super) method: Method,
    /// Whether it stops: then the doors let it pass where they let nothing else.
    pub(super) stops: bool,
    /// `None`: it is served by somebody else, at the doors or beside the plant.
    pub(super) handler: Option<MethodRouter<Plant>>,
    /// What it is for.
    pub(super) about: &'static str,
    /// What may stand behind a question mark.
    pub(super) query: Vec<Parameter>,
    pub(super) body: Option<Describe>,
    pub(super) answers: Vec<Answer>,
    /// The statuses of its problem documents.
    pub(super) problems: Vec<u16>,
}

/// What may be said in the address.
#[derive(Debug, Clone, Copy)]
pub(super) struct Parameter {
    pub(super) name: &'static str,
    pub(super) about: &'static str,
    pub(super) kind: &'static str,
}

/// What is answered when nothing is wrong.
pub(super) struct Answer {
    pub(super) status: u16,
    pub(super) about: &'static str,
    pub(super) content: &'static str,
    pub(super) describe: Option<Describe>,
}

const JSON: &str = "application/json";
pub(super) const WAIT: Parameter = Parameter {
    name: "wait",
    about: "how long the outcome is waited for: 0 to 30s, 2s unless it is said",
    kind: "string",
};

impl Route {
    fn new<H, T>(method: Method, path: &'static str, handler: H, about: &'static str) -> Self
    where
        H: Handler<T, Plant>,
        T: 'static,
    {
        let filter = MethodFilter::try_from(method.clone()).unwrap_or(MethodFilter::GET);
        Self { handler: Some(on(filter, handler)), ..Self::elsewhere(method, path, about) }
    }

    /// One that is described here and served elsewhere.
    pub(super) fn elsewhere(method: Method, path: &'static str, about: &'static str) -> Self {
        let (query, answers) = (Vec::new(), Vec::new());
        let problems = vec![400, 401, 403];
        Self { path, method, stops: false, handler: None, about, query, body: None, answers, problems }
    }

    pub(super) fn get<H, T>(path: &'static str, handler: H, about: &'static str) -> Self
    where
        H: Handler<T, Plant>,
        T: 'static,
    {
        let route = Self::new(Method::GET, path, handler, about);
        if path.contains('{') { route.or_problem(404) } else { route }
    }

    /// A command: its body in JSON, and an answer for each outcome.
    pub(super) fn command<H, T, B: JsonSchema>(path: &'static str, handler: H, about: &'static str) -> Self
    where
        H: Handler<T, Plant>,
        T: 'static,
    {
        let mut route = Self::new(Method::POST, path, handler, about)
            .answers::<CommandView>(200, "it is confirmed")
            .answers::<CommandView>(202, "it is not settled yet; Location says where it will be told");
        route.query.push(WAIT);
        route.body = Some(SchemaGenerator::subschema_for::<B>);
        route.problems.extend([404, 409, 410, 413, 415, 422, 504]);
        route
    }

    /// A command that stops.
    pub(super) fn stop<H, T, B: JsonSchema>(path: &'static str, handler: H, about: &'static str) -> Self
    where
        H: Handler<T, Plant>,
        T: 'static,
    {
        Self { stops: true, ..Self::command::<H, T, B>(path, handler, about) }
    }

    pub(super) fn write<H, T>(path: &'static str, handler: H, about: &'static str) -> Self
    where
        H: Handler<T, Plant>,
        T: 'static,
    {
        let route = Self::new(Method::PUT, path, handler, about);
        let mut route = route.answers::<WrittenView>(200, "it holds the value");
        route.body = Some(SchemaGenerator::subschema_for::<NewValue>);
        route.problems.extend([404, 409, 413, 415, 422, 504]);
        route
    }

    /// Something that is done with an alarm, at once.
    pub(super) fn of_alarm<H, T, B: JsonSchema>(path: &'static str, handler: H, about: &'static str) -> Self
    where
        H: Handler<T, Plant>,
        T: 'static,
    {
        let mut route = Self::new(Method::POST, path, handler, about)
            .answers::<AlarmView>(200, "the alarm as it is since; what was done before changes nothing");
        route.body = Some(SchemaGenerator::subschema_for::<B>);
        route.problems.extend([404, 409, 413, 415, 422]);
        route
    }

    /// Something that is done at once and has nothing to say.
    pub(super) fn deed<H, T, B: JsonSchema>(path: &'static str, handler: H, about: &'static str) -> Self
    where
        H: Handler<T, Plant>,
        T: 'static,
    {
        let done = Answer { status: 204, about: "it is done", content: "", describe: None };
        let mut route = Self::new(Method::POST, path, handler, about).answer(done);
        route.body = Some(SchemaGenerator::subschema_for::<B>);
        route.problems.extend([404, 413, 415, 422]);
        route
    }

    pub(super) fn answers<A: JsonSchema>(self, status: u16, about: &'static str) -> Self {
        self.answer(Answer {
            status,
            about,
            content: JSON,
            describe: Some(SchemaGenerator::subschema_for::<A>),
        })
    }

    pub(super) fn answer(mut self, answer: Answer) -> Self {
        self.answers.push(answer);
        self
    }

    pub(super) fn or_problem(mut self, status: u16) -> Self {
        self.problems.push(status);
        self
    }

    pub(super) fn with_query(mut self, parameter: Parameter) -> Self {
        self.query.push(parameter);
        self
    }
}
